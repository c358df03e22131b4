"""How long two arms take that share room, on virtual time: beside other ways to let them share it."""

from dataclasses import dataclass
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
_SHIFT_S = 0.12
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
    shifted: float
    """One of the two begins later, by the shift with which both are done first and never meet."""


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
            took.append(_Took(together, max(times), sum(times), zones, _shifted_s(*alone)))
    what = f"makespan of two arms in one room, random programs, {done} of {len(took)} done"
    others = [
        ([each.longer for each in took], "the longer one alone", 1.10),
        ([each.after for each in took], "one after the other", 0.6),
        ([each.zones for each in took], "a zone drawn by hand", 0.75),
        ([each.shifted for each in took], "the best shift of one of them", 0.7),
    ]
    return [_row(what, [each.together for each in took], other, name, aim) for other, name, aim in others]


def _row(what: str, together: list[float], other: list[float], name: str, aim: float) -> Row:
    ratios = [one / its for one, its in zip(together, other, strict=True)]
    return Row(what, mean(together), mean(ratios), f"of {name}, worst {max(ratios):.2f} (aim {aim:g})")


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
        clock = self._cell.world.clock
        clock.after(_START_S, self._look)
        self.took_s = self._cell.run(LONGEST_S) - _START_S

    def _look(self) -> None:
        world = self._cell.world
        if self._side in world.seen.feedback:
            q = world.models[self._side].coupling.joints(world.seen.feedback[self._side].position)
            self._poses.append(q)
        world.clock.after(_SAMPLE_S, self._look)

    def capsules(self) -> tuple[np.ndarray, np.ndarray]:
        """`(m, c, 2, 3)` [m] in world every `_SAMPLE_S`, and their radii `(c,)` [m]; not those that never move."""
        world = self._cell.world
        model, planner = world.models[self._side], world.planners[self._side]
        moves = np.array([each.link != 0 for each in model.body])
        points = transform_points(planner.pose_world_base, model.capsules(np.array(self._poses)))
        return points[:, moves], model.capsule_radii[moves]


def _shifted_s(one: _Alone, other: _Alone) -> float:
    """Both as planned, but one begins later: the shortest time until both are done and never meet."""
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
    steps = round(_SHIFT_S / _SAMPLE_S)
    best = one.took_s + other.took_s
    for shift in range(-len(b), len(a) + 1, steps):
        lasts = max(one.took_s - min(shift, 0) * _SAMPLE_S, other.took_s + max(shift, 0) * _SAMPLE_S)
        if lasts < best and not _meet(near, shift):
            best = lasts
    return best


def _meet(near: np.ndarray, shift: int) -> bool:
    """Whether they meet where the second one begins so many samples later; who is done, or has not begun, stands."""
    m, n = near.shape
    at = np.arange(min(shift, 0), max(m, n + shift))
    return bool(near[np.clip(at, 0, m - 1), np.clip(at - shift, 0, n - 1)].any())
