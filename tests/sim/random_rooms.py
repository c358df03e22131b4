"""Two to four arms with random programs in one room: each can be done alone, and ends clear of the others' ways."""

import random
from collections.abc import Iterator
from pathlib import Path

from tests.sim.apart_cell import BASES, Apart, apart_cell

LONGEST_S = 90.0
_START = "MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0 F=100"
_CLEAR = "ML X=1000 Y={y:.0f} Z=1300 A=0 B=90 C=0 F=1000"


def program(rng: random.Random) -> str:
    """Some visits to the room that all arms reach; in between it may go out of the others' way."""
    lines = [_START]
    for _ in range(rng.randint(2, 4)):
        for _ in range(rng.randint(1, 3)):
            x, y, z = rng.uniform(1000, 1950), rng.uniform(-350, 350), rng.uniform(1000, 1500)
            lines.append(f"ML X={x:.0f} Y={y:.0f} Z={z:.0f} A=0 B=90 C=0 F={rng.choice([500, 1000, 1500])}")
            if rng.random() < 0.2:
                lines.append("WAIT 0.3")
        if rng.random() < 0.5:
            lines.append(_CLEAR.format(y=rng.uniform(-200, 200)))
    return "\n".join([*lines, _CLEAR.format(y=0.0), "HOME F=100"]) + "\n"


def rooms(seeds: range, folder: Path, arms: int = 2) -> Iterator[tuple[int, dict[str, str], Apart]]:
    """The seeds whose programs so many arms can do, with the programs and a cell of them."""
    for seed in seeds:
        rng = random.Random(seed)
        programs = {side: program(rng) for side in list(BASES)[:arms]}
        try:
            yield seed, programs, Apart(apart_cell(folder / f"{arms} arms {seed}", programs))
        except AssertionError:
            continue  # `cell check` found something that one of them cannot do
