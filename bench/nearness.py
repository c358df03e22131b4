"""Which sections of robots come too near to each other: what one question costs, and a cell of robots in a ring.

`python -m bench nearness` alone. The robots are six-axis arms that wave, their sections 10 ms apart.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path

import numpy as np

from bench.timing import Row, median_s
from cell.geometry import transform_points
from cell.manager.separation.nearness import Nearness
from cell.messages.sections import Sections
from robot_agent.kinematics import Model, load_model
from robot_agent.workspace import sweep

ROBOTS = 8
RATE_HZ = 50.0
OWNED, ASKED, NEW = 100, 40, 2
"""Sections that a robot has, that it asks for, and by how many both move on from one question to the next."""
QUESTIONS = 300
_GROWTH_M, _MARGIN_M = 0.05, 0.03
_SECTION_S = 0.01
_MODEL = Path(__file__).parents[1] / "cell_configs" / "models" / "six_axis.yaml"


@dataclass(slots=True)
class _Arm:
    name: str
    way: Sections

    def owned(self, step: int) -> Sections:
        return self.way[NEW * step : NEW * step + OWNED]

    def asked(self, step: int) -> Sections:
        return self.way[NEW * step + OWNED : NEW * step + OWNED + ASKED]


def nearness() -> Iterator[Row]:
    """Two robots far away, two near ones with and without anything new, and a ring of eight."""
    model = load_model(_MODEL)
    one, far = _arm(model, 0, 0.0, 0.0), _arm(model, 1, 20.0, 0.0)
    near = _beside(model, one)
    known = _separation()
    far_s = median_s(lambda: known.first_too_near(one.name, one.asked(0), far.name, far.owned(0)), QUESTIONS)
    yield Row("cleared space: two robots far away", far_s, far_s / 1e-5, "of 10 us")
    asked, owned = one.asked(0), near.owned(0)
    same_s = median_s(lambda: known.first_too_near(one.name, asked, near.name, owned), QUESTIONS)
    yield Row("cleared space: two near robots, nothing new", same_s, same_s / 1e-4, "of 0.1 ms")
    steps = iter(range(QUESTIONS + 1))

    def rolled() -> None:
        step = next(steps)
        known.first_too_near(one.name, one.asked(step), near.name, near.owned(step))

    new_s = median_s(rolled, QUESTIONS)
    yield Row(f"cleared space: two near robots, {NEW} new sections each", new_s, new_s / 5e-4, "of 0.5 ms")
    yield _together(_ring(model))


def _together(arms: list[_Arm]) -> Row:
    """Each asks about all others."""
    separation, steps = _separation(), iter(range(QUESTIONS + 1))

    def whole() -> None:
        step = next(steps)
        for arm, other in permutations(arms, 2):
            separation.first_too_near(arm.name, arm.asked(step), other.name, other.owned(step))

    whole_s = median_s(whole, QUESTIONS)
    what = f"cleared space: {len(arms)} robots near each other, per second"
    return Row(what, RATE_HZ * whole_s, RATE_HZ * whole_s, "of a core")


def _ring(model: Model) -> list[_Arm]:
    """As close around the middle of a cell as leaves all their ways clear."""
    angles = (2.0 * np.pi * np.arange(ROBOTS) / ROBOTS).tolist()
    for radius in np.arange(1.0, 9.0, 0.1).tolist():
        arms = [_arm(model, k, radius * np.cos(a), radius * np.sin(a), a + np.pi) for k, a in enumerate(angles)]
        if all(_clear(one, other) for one, other in permutations(arms, 2)):
            return arms
    raise AssertionError("no ring of arms is clear")


def _clear(one: _Arm, other: _Arm) -> bool:
    ways = one.way[::10], other.way[::10]
    return _separation().first_too_near(one.name, ways[0], other.name, ways[1]) is None


def _beside(model: Model, one: _Arm) -> _Arm:
    """An arm as near to one as leaves both their ways clear."""
    for apart_m in np.arange(1.0, 6.0, 0.05).tolist():
        other = _arm(model, 2, apart_m, 0.0)
        if _clear(one, other):
            return _arm(model, 2, apart_m + _GROWTH_M, 0.0)
    raise AssertionError("no two arms are clear of each other")


def _arm(model: Model, number: int, x: float, y: float, turn: float = 0.0) -> _Arm:
    """One that stretches aslant to x, so that boxes do not tell it from one beside it."""
    pose = np.eye(4)
    pose[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
    pose[:2, 3] = x, y
    count = NEW * (QUESTIONS + 1) + OWNED + ASKED
    phases = 0.7 * number + np.arange(model.n)
    aslant = model.home.copy()
    aslant[0] += np.pi / 4
    q = aslant + 0.3 * np.sin(2.0 * _SECTION_S * np.arange(count)[:, None] + phases)
    points = transform_points(pose, model.capsules(q)).astype(np.float32)
    radii = np.array(np.broadcast_to(sweep(model, pose, q[:1]).radii + _GROWTH_M, points.shape[:2]), np.float32)
    ids = np.random.default_rng(number).integers(0, 2**64, count, dtype=np.uint64)
    return _Arm(f"arm {number}", Sections(ids, points, radii))


def _separation() -> Nearness:
    return Nearness(_MARGIN_M, {}, lambda _: frozenset({0}), lambda _, capsule: f"link {capsule}")
