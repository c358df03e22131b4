"""How long two arms take that share room, on virtual time: beside the longer one alone, and one after the other."""

from pathlib import Path
from statistics import mean
from tempfile import TemporaryDirectory

from bench.timing import Row
from tests.sim.apart_cell import SIDES, Apart, apart_cell
from tests.sim.random_rooms import LONGEST_S, rooms

_PAIRS = range(8)
_START_S = 1.2
"""Of switching on, which each run has once."""
_STANDS = "HOME F=100\n"


def makespan() -> list[Row]:
    """Of random programs; see `tests.sim.random_rooms`."""
    took, beside, after, done = [], [], [], 0
    with TemporaryDirectory() as name:
        folder = Path(name)
        for seed, programs, cell in rooms(_PAIRS, folder):
            together = cell.run(LONGEST_S) - _START_S
            done += cell.done
            alone = [_alone(folder / f"{side} {seed}", programs, side) for side in SIDES]
            took.append(together)
            beside.append(together / max(alone))
            after.append(together / sum(alone))
    what = f"makespan of two arms in one room, random programs, {done} of {len(took)} done"
    return [
        Row(what, mean(took), mean(beside), f"of the longer one alone, worst {max(beside):.2f} (aim 1.10)"),
        Row(what, mean(took), mean(after), f"of one after the other, worst {max(after):.2f} (aim 0.6)"),
    ]


def _alone(folder: Path, programs: dict[str, str], side: str) -> float:
    cell = Apart(apart_cell(folder, dict.fromkeys(SIDES, _STANDS) | {side: programs[side]}))
    return cell.run(LONGEST_S) - _START_S


if __name__ == "__main__":
    for row in makespan():
        print(*row.cells(), sep="   ")
