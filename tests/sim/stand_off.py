"""Robots that wait for each other: one is let back along its path and halted, the others go first."""

import re
from collections.abc import Callable, Iterable

from cell.messages import Halt, Mode, RobotState, SetOverride
from tests.sim.judge.facts import Facts

_STUCK_S = 3.0
"""Robots that have waited for each other for so long do not get on by themselves."""
_BACK_S, _BEGINS_S = 6.0, 1.5
"""So long one goes back, at most, or until it stands, or is out of what others wait for; it takes so long to begin."""
_HALTED_S = 6.0
"""So long the others go first."""
_BACKWARDS = -50.0
_HELD = re.compile(r"zone (\w+): held by (\w+)")


class StandOffs:
    """What a patient operator does about them, as `docs/operating.md` says; who goes back is another one each time."""

    def __init__(self, facts: Facts, order: Callable[[str, object], None]) -> None:
        self._facts = facts
        self._order = order
        self._stuck: dict[str, tuple[frozenset[str], float]] = {}
        """By robot, whom it waits for, and since when it has waited without a motion."""
        self._zones: dict[str, tuple[str, str]] = {}
        """By robot, the zone that it waits for, and who holds that."""
        self._runs: set[str] = set()
        """Robots on the path of their programs: only there they go back."""
        self._back: dict[str, float] = {}
        """Who is let back, and since when."""
        self._out_of: dict[str, set[str]] = {}
        """By robot that is let back, the zones that others wait for and that it is in."""
        self._halted: dict[str, float] = {}
        """Who is halted after that, and since when."""
        self._parted = 0

    def busy_with(self, robot: str) -> bool:
        """Nobody else should give this robot orders."""
        return robot in self._back or robot in self._halted

    def look(self, states: Iterable[RobotState]) -> None:
        """Give the orders that are due."""
        now = self._facts.now
        for state in states:
            self._note(state)
            self._go_on(state)
        stuck = [robot for robot in sorted(self._stuck) if robot in self._waited_for(robot)]
        if stuck and not self._back and all(now - self._stuck[robot][1] > _STUCK_S for robot in stuck):
            free = [robot for robot in stuck if robot in self._runs - self._halted.keys()]
            if free:
                back = free[self._parted % len(free)]
                waited_for = {zone for zone, holder in self._zones.values() if holder == back}
                self._back[back], self._out_of[back] = now, waited_for & self._facts.inside_now(back)
                self._parted += 1

    def _note(self, state: RobotState) -> None:
        robot = state.robot
        others = set(self._facts.robots) - {robot}
        named = frozenset(others & set(re.findall(r"\w+", state.waiting_for)))
        held = _HELD.match(state.waiting_for)
        self._zones.pop(robot, None)
        if held is not None:
            self._zones[robot] = held[1], held[2]
        if state.mode is Mode.RUNNING:
            self._runs.add(robot)
        else:
            self._runs.discard(robot)
        if state.mode not in (Mode.RUNNING, Mode.RETURNING) or not named or self._facts.moving(robot):
            self._stuck.pop(robot, None)
        else:
            self._stuck[robot] = named, self._stuck.get(robot, (named, self._facts.now))[1]

    def _waited_for(self, robot: str) -> set[str]:
        """By it, by those that it waits for, and so on; as far as these are stuck, too."""
        found: set[str] = set()
        left = [robot]
        while left:
            named, _ = self._stuck.get(left.pop(), (frozenset(), 0.0))
            left += named - found
            found |= named
        return found

    def _go_on(self, state: RobotState) -> None:
        robot, now = state.robot, self._facts.now
        if robot in self._back:
            back_s = now - self._back[robot]
            stands = back_s > _BEGINS_S and not self._facts.moving(robot)
            wanted = self._out_of[robot]
            out = bool(wanted) and not wanted & self._facts.inside_now(robot)
            if out or stands or back_s > _BACK_S or state.mode is not Mode.RUNNING:
                del self._back[robot]
                self._halted[robot] = now
            else:
                self._order(robot, SetOverride(_BACKWARDS))
        if robot in self._halted:
            if now - self._halted[robot] > _HALTED_S or state.mode not in (Mode.RUNNING, Mode.HALTED):
                del self._halted[robot]
            elif state.mode is Mode.RUNNING:
                self._order(robot, Halt())
