"""Robots that no way back frees from each other: one is jogged aside, and goes on when the others have passed.

A way back does not where the manager says so, and where the same robots meet again although each has been let back.
"""

import re
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from cell.geometry import capsule_distance, transform_points
from cell.messages import Halt, Mode, RobotState
from tests.sim.jog_key import hold_key
from tests.sim.judge.facts import Facts, Floats
from tests.sim.world import World

_LASTS_S = 3.0
"""So long it takes until somebody comes."""
_SPEED, _LINEAR_SPEED = 0.25, 0.1
"""[rad/s, m/s]"""
_HELD_S = 4.0
_LOOKS = np.geomspace(0.01, 1.0, 8)
"""Places on the way of a key that are looked at, as shares of it."""
_KEYS = 4
"""So many keys are tried, one after the other."""
_OFTEN = 3
"""A stand-off that is told so often is not over by a way back: of two robots each has been let back before."""
_PASSED_S = 15.0
"""So long the others have for their way, unless their programs end sooner."""
_SEEN_S = 2.0
"""So long after a key it is seen whether the others go on."""


@dataclass(slots=True)
class _Aside:
    others: tuple[str, ...]
    keys: int = 0
    """So many were held."""
    held_at: float | None = None
    """When the newest of them was pressed."""


class JogAside:
    """What the remedy of such a stand-off says; who is jogged is another one each time."""

    def __init__(self, world: World, facts: Facts, by: str, order: Callable[[str, object], None]) -> None:
        self._world = world
        self._facts = facts
        self._by = by
        self._order = order
        self._aside: dict[str, _Aside] = {}
        self._told: defaultdict[tuple[str, ...], set[float]] = defaultdict(set)
        """By its robots, each stand-off: since when."""
        self._times = 0

    def busy_with(self, robot: str) -> bool:
        """Nobody else should give this robot orders."""
        return robot in self._aside

    def look(self, states: Iterable[RobotState], done: set[str]) -> None:
        """Give the orders that are due; `done`: whose programs have ended."""
        manager = self._world.operator(self._by).manager
        for standoff in manager.deadlocks if manager is not None else ():
            told = self._told[standoff.robots]
            told.add(standoff.since)
            lasts = manager.cell_time - standoff.since > _LASTS_S
            to_jog = "no way back" in standoff.remedy or len(told) >= _OFTEN
            if lasts and to_jog and not self._aside.keys() & set(standoff.robots):
                told.clear()
                robot = standoff.robots[self._times % len(standoff.robots)]
                self._aside[robot] = _Aside(tuple(each for each in standoff.robots if each != robot))
                self._times += 1
        by_robot = {state.robot: state for state in states}
        for robot in self._aside.keys() & by_robot.keys():
            self._go_on(by_robot, robot, self._aside[robot], done)

    def _go_on(self, states: Mapping[str, RobotState], robot: str, aside: _Aside, done: set[str]) -> None:
        mode = states[robot].mode
        if aside.held_at is None:
            if mode is Mode.HALTED:
                self._press(robot, aside)
            elif mode in (Mode.RUNNING, Mode.RETURNING):
                self._order(robot, Halt())
            else:
                del self._aside[robot]
            return
        let_go_s = self._facts.now - aside.held_at - _HELD_S
        if let_go_s <= _SEEN_S:
            return
        if aside.keys < _KEYS and any(robot in _named(states[other]) for other in aside.others if other in states):
            self._press(robot, aside)
        elif let_go_s > _PASSED_S or done >= set(aside.others):
            del self._aside[robot]

    def _press(self, robot: str, aside: _Aside) -> None:
        axis, speed = self._away(robot, aside)
        hold_key(self._world, self._by, robot, axis, speed, _HELD_S, lets_go=True)
        aside.keys, aside.held_at = aside.keys + 1, self._facts.now

    def _away(self, robot: str, aside: _Aside) -> tuple[str, float]:
        """The key that leads farthest from the others and no nearer on the way, after that the next one."""
        model = self._world.models[robot]
        stands = model.coupling.joints(self._facts.measured(robot)[None])[0]
        here, found = self._distance(robot, stands[None], aside.others)[0], []
        for joint, name in enumerate(model.joint_names):
            for speed in (1.0, -1.0) * np.array(_LINEAR_SPEED if model.linear[joint] else _SPEED):
                way = stands + np.outer(speed * _HELD_S * _LOOKS, np.eye(model.n)[joint])
                distances = self._distance(robot, np.clip(way, *model.limits.position.T), aside.others)
                found.append((bool((distances >= here).all()), distances[-1], name, float(speed)))
        found.sort(reverse=True)
        return found[aside.keys % len(found)][2:]

    def _distance(self, robot: str, way: Floats, others: tuple[str, ...]) -> Floats:
        """Of the bodies, at joints `(m, n)` [m]."""
        model = self._world.models[robot]
        mine = transform_points(self._world.planners[robot].pose_world_base, model.capsules(way))
        least = np.full(len(way), np.inf)
        for other in others:
            its = self._facts.points(other, self._facts.measured(other)[None])[0]
            radii = model.capsule_radii[:, None], self._world.models[other].capsule_radii
            away = capsule_distance(mine[:, :, None], radii[0], its, radii[1])
            np.minimum(least, away.min(axis=(1, 2)), out=least)
        return least


def _named(state: RobotState) -> set[str]:
    """Words of what it waits for, robots among them."""
    return set(re.findall(r"\w+", state.waiting_for))
