"""How long two arms take that share room, on virtual time: beside other ways to let them share it."""

from dataclasses import dataclass
from itertools import pairwise, zip_longest
from pathlib import Path
from statistics import mean
from tempfile import TemporaryDirectory

import numpy as np

from bench.timing import Row
from cell.geometry import capsule_distance, transform_points
from tests.sim.apart_cell import MARGIN_M, SIDES, Apart, apart_cell
from tests.sim.random_rooms import LONGEST_S, rooms

_PAIRS = range(8)
_START_S = 1.2
"""Of switching on, which each run has once."""
_STANDS = "HOME F=100\n"
_ZONE = """
zones:
  handover:
    size: [900, 2600, 2600]
    pose: {X: 0, Y: 0, Z: 1400, A: 0, B: 0, C: 0}
    robots: [left, right]
"""
"""That of `cell_configs/two_arms`: outside it each arm stays on its own side."""
_SAMPLE_S = 0.04


@dataclass(frozen=True, slots=True)
class _Took:
    """Seconds, switching on not counted."""

    together: float
    longer: float
    """Of the one that takes longer alone."""
    after: float
    """One after the other."""
    zones: float
    synchronised: float
    """The moves in pairs, each pair as one motion of all axes that begins and ends together."""


def makespan() -> list[Row]:
    """Of random programs; see `tests.sim.random_rooms`."""
    took, done = [], 0
    with TemporaryDirectory() as name:
        folder = Path(name)
        for seed, programs, cell in rooms(_PAIRS, folder):
            together = cell.run(LONGEST_S) - _START_S
            done += cell.done
            alone = [_Alone(folder / f"{side} {seed}", programs, side) for side in SIDES]
            times = [each.took_s for each in alone]
            zones = _with_zones(folder / f"zones {seed}", programs)
            took.append(_Took(together, max(times), sum(times), zones, _synchronised_s(*alone)))
    what = f"makespan of two arms in one room, random programs, {done} of {len(took)} done"
    others = [
        ([each.longer for each in took], "the longer one alone", 1.10),
        ([each.after for each in took], "one after the other", 0.6),
        ([each.zones for each in took], "a zone drawn by hand", 0.75),
        ([each.synchronised for each in took], "one synchronised timing of both", 0.7),
    ]
    return [_row(what, took, other, name, aim) for other, name, aim in others]


def _row(what: str, took: list[_Took], other: list[float], name: str, aim: float) -> Row:
    ratios = [each.together / its for each, its in zip(took, other, strict=True)]
    least = mean(each.longer / its for each, its in zip(took, other, strict=True))
    note = f"of {name}, worst {max(ratios):.2f} (aim {aim:g}; the longer one alone takes {least:.2f})"
    return Row(what, mean(each.together for each in took), mean(ratios), note)


def _with_zones(folder: Path, programs: dict[str, str]) -> float:
    file = apart_cell(folder, programs, None)
    file.write_text(file.read_text() + _ZONE)
    return Apart(file).run(LONGEST_S) - _START_S


class _Alone:
    """One of the arms in its program, while the other one stands at home."""

    def __init__(self, folder: Path, programs: dict[str, str], side: str) -> None:
        self._cell = Apart(apart_cell(folder, dict.fromkeys(SIDES, _STANDS) | {side: programs[side]}))
        self._side = side
        self._poses: list[np.ndarray] = []
        self._lines: list[int] = []
        clock = self._cell.world.clock
        clock.after(_START_S, self._look)
        self.took_s = self._cell.run(LONGEST_S) - _START_S

    def _look(self) -> None:
        world = self._cell.world
        if self._side in world.seen.feedback and self._side in world.seen.robots:
            q = world.models[self._side].coupling.joints(world.seen.feedback[self._side].position)
            self._poses.append(q)
            self._lines.append(world.seen.robots[self._side].program.line)
        world.clock.after(_SAMPLE_S, self._look)

    def capsules(self) -> tuple[np.ndarray, np.ndarray]:
        """`(m, c, 2, 3)` [m] in world every `_SAMPLE_S`, and their radii `(c,)` [m]; not those that never move."""
        world = self._cell.world
        model, planner = world.models[self._side], world.planners[self._side]
        moves = np.array([each.link != 0 for each in model.body])
        points = transform_points(planner.pose_world_base, model.capsules(np.array(self._poses)))
        return points[:, moves], model.capsule_radii[moves]

    def ends(self) -> list[int]:
        """The samples at which its lines end, the first one before them."""
        return [0, *(np.flatnonzero(np.diff(self._lines)) + 1).tolist(), len(self._lines) - 1]


def _synchronised_s(one: _Alone, other: _Alone) -> float:
    """The next line of each, one pair after the other: together, or one after the other where they would meet.

    That is what a planner for all axes at once makes of two programs whose ways are given: in each of its motions the
    faster arm waits for the slower one.
    """
    (a, radii), (b, other_radii) = one.capsules(), other.capsules()
    near = np.array(
        [
            (
                capsule_distance(pose[None, :, None], radii[None, :, None], b[:, None], other_radii[None, None])
                < MARGIN_M
            ).any(axis=(1, 2))
            for pose in a
        ]
    )
    samples = 0
    rest, its_rest = (len(a) - 1,) * 2, (len(b) - 1,) * 2
    for line, its_line in zip_longest(pairwise(one.ends()), pairwise(other.ends())):
        (begin, end), (its_begin, its_end) = line or rest, its_line or its_rest
        takes, its_takes = end - begin, its_end - its_begin
        at = np.linspace(0.0, 1.0, max(takes, its_takes) + 1)
        meet = near[np.rint(begin + takes * at).astype(int), np.rint(its_begin + its_takes * at).astype(int)].any()
        samples += takes + its_takes if meet else max(takes, its_takes)
    return samples * _SAMPLE_S
