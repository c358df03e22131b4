"""Two real arms in one room without zones: they are kept apart whatever dies meanwhile, and come to their ends."""

import os
import re
import shlex
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from live_cell import LiveCell, Process, Recorder, change, wait_until

from cell.geometry import capsule_distance
from cell.messages import Event, Mode, Presence, ProgramState, RobotState, Sections

NEAR_M = 0.2
"""Robots that never come nearer show nothing."""
FROZEN_S = 1.0
STANDS_S = 3.0
"""Robots that wait for each other for so long do so for good."""
_LATER = 5
"""Links differ in delay: robots are too near where they are so with as many newer presences of each."""
_FOR_ROOM = " would "
"""In what is said of a robot that waits for room, another robot's or one that another needs first."""
_ORDER = re.compile(r"`(cell [^`]+)`")
_USUAL = {
    Mode.DISABLED: "enable",
    Mode.READY: "run",
    Mode.HALTED: "continue",
    Mode.FAULT: "reset",
    Mode.OFF_PATH: "return",
}


@pytest.fixture
def room(tmp_path: Path) -> Iterator[LiveCell]:
    """A copy of the cell with a shared room, on free ports, nothing started yet: left stays inside until it is told."""
    with LiveCell(tmp_path, cell="shared_room") as cell:
        cell.without_repeats("left")
        change(cell.settings.robots["left"].program, {"WAIT 0.4\n": "M 1\n"})
        change(cell.settings.robots["right"].program, {"WAIT 2 ": "WAIT 0 ", "WAIT 0.6 ": "WAIT 2 "})
        yield cell


class Onlooker:
    """Hears each robot through its gateway, which outlives manager and agents, and judges what they own."""

    def __init__(self, room: LiveCell, stack: ExitStack) -> None:
        self._robots = room.settings.robots
        assert room.settings.separation is not None
        self._margin_m = room.settings.separation.margin_m
        self._recorders = [
            Recorder(stack.enter_context(room.client_of(robot.gateway)), f"robot/{name}/*", f"event/robot/{name}")
            for name, robot in self._robots.items()
        ]
        self.states: dict[str, RobotState] = {}
        self.moved_at: dict[str, float] = {}
        self._owned: dict[str, tuple[Sections, frozenset[int]]] = {}
        self._near = Counter[str]()
        self.nearest_m = np.inf

    def look(self) -> None:
        """Take in what was said since the last look, and judge the newest words of both."""
        new = set[str]()
        for recorder in self._recorders:
            for message in recorder.take():
                match message:
                    case RobotState():
                        self._hear(message)
                    case Presence(robot=robot, way=way) if way.owned:
                        self._owned[robot] = way.sections[: way.owned], frozenset(way.fixed)
                        new.add(robot)
                    case Event(code="space_forced"):
                        raise AssertionError(message.text)
            recorder.messages.clear()
        if new and len(self._owned) == len(self._robots):
            self._judge(new)

    def _hear(self, state: RobotState) -> None:
        self.states[state.robot] = state
        if state.tcp_speed_m_s or state.mode is not Mode.RUNNING:
            self.moved_at[state.robot] = time.monotonic()

    def _judge(self, new: set[str]) -> None:
        away = _away(*self._owned.values())
        if away >= self._margin_m:
            self._near, self.nearest_m = Counter(), min(self.nearest_m, away)
            return
        self._near.update(new)
        assert min(self._near[robot] for robot in self._robots) <= _LATER, (
            f"what they own is {1000 * away:.1f} mm apart, {1000 * self._margin_m:g} mm are kept"
        )

    def mode_of(self, robot: str) -> Mode | None:
        """Its newest."""
        self.look()
        return self.states[robot].mode if robot in self.states else None

    def boot_of(self, robot: str) -> str:
        """Of its newest agent."""
        self.look()
        return self.states[robot].boot

    def stands_inside(self, robot: str) -> bool:
        """It waits in its program until it is told to leave."""
        self.look()
        return robot in self.states and self.states[robot].program.flag is not None

    def all_say(self, text: str) -> bool:
        """All wait for something with this text."""
        return all(self.says(robot, text) for robot in self._robots)

    def moves(self, robot: str) -> bool:
        """In its program, at speed."""
        self.look()
        state = self.states.get(robot)
        return state is not None and state.mode is Mode.RUNNING and (state.tcp_speed_m_s or 0.0) > 0.2

    def says(self, robot: str, text: str) -> bool:
        """It waits for something with this text."""
        self.look()
        return robot in self.states and text in self.states[robot].waiting_for

    def done(self, robot: str) -> bool:
        """It has come to the end of its program."""
        self.look()
        return self.states[robot].program.state is ProgramState.DONE

    @property
    def stand_off(self) -> bool:
        """All wait in their programs for each other."""
        now = time.monotonic()
        waiting = (state.mode is Mode.RUNNING and _FOR_ROOM in state.waiting_for for state in self.states.values())
        return all(waiting) and all(now - self.moved_at.get(each, now) > STANDS_S for each in self.states)


def _away(one: tuple[Sections, frozenset[int]], other: tuple[Sections, frozenset[int]]) -> float:
    """Between all capsules of two robots that do not both belong to bases [m]; at most 1 m, where they are not near."""
    (a, a_fixed), (b, b_fixed) = one, other
    low_a, high_a = a.points.min(axis=2) - a.radii[..., None], a.points.max(axis=2) + a.radii[..., None]
    low_b, high_b = b.points.min(axis=2) - b.radii[..., None], b.points.max(axis=2) + b.radii[..., None]
    gap = np.maximum(low_a[:, :, None, None] - high_b, low_b - high_a[:, :, None, None]).max(axis=-1)
    stands_a = np.isin(np.arange(a.radii.shape[1]), list(a_fixed))
    stands_b = np.isin(np.arange(b.radii.shape[1]), list(b_fixed))
    gap[:, stands_a[:, None, None] & np.ones(len(b), bool)[:, None] & stands_b] = np.inf
    k, i, m, j = np.nonzero(gap < NEAR_M)
    if not len(k):
        return 1.0
    ends = a.points[k, i].astype(float), a.radii[k, i].astype(float)
    others = b.points[m, j].astype(float), b.radii[m, j].astype(float)
    return min(1.0, float(capsule_distance(*ends, *others).min()))


class Operator:
    """Starts programs, and does what messages recommend, then what a robot's mode asks for, until they are done."""

    def __init__(self, room: LiveCell, onlooker: Onlooker) -> None:
        self._room = room
        self._onlooker = onlooker
        self._runs = set[str]()
        self._lets_out = False
        self.given: list[str] = []

    def run(self, robot: str) -> None:
        """From now on its program is to come to its end."""
        self._runs.add(robot)

    def let_out(self) -> None:
        """From now on who stands inside may leave."""
        self._lets_out = True

    def until(self, condition: Callable[[], bool], timeout_s: float, what: str) -> None:
        """Do what is asked for until this is so: on a busy computer that stands still for a moment, drives fail."""
        deadline = time.monotonic() + timeout_s
        while not condition():
            states = self._onlooker.states
            assert time.monotonic() < deadline, f"not within {timeout_s:g} s: {what}; given {self.given}; {states}"
            for robot in self._runs & states.keys():
                self._help(states[robot])
            if self._onlooker.stand_off:
                self._let_back("left", "right")
            threading.Event().wait(0.1)

    def _help(self, state: RobotState) -> None:
        texts = (*state.alarms, state.waiting_for, state.program.error)
        said = [order for text in texts for order in _ORDER.findall(text)]
        said = [order for order in said if self._lets_out or not order.startswith("cell flag")]
        usual = f"cell {_USUAL[state.mode]} {state.robot}" if state.mode in _USUAL else ""
        if not self._onlooker.done(state.robot) and (order := (said or [usual])[0]):
            self._give(*shlex.split(order)[1:])

    def _give(self, *words: str) -> None:
        order = self._room.order(*words)
        self.given.append(f"{' '.join(words)} -> {order.exit_code()} {order.output.strip()[:150]}")
        self._onlooker.look()

    def _let_back(self, robot: str, other: str) -> None:
        """As `docs/operating.md` says of robots that wait for each other."""
        self._give("override", robot, "--", "-50")
        self._until(lambda: self._onlooker.says(robot, "beginning"), f"{robot} back at the beginning of its motion")
        self._give("halt", robot)
        self._until(lambda: self._onlooker.moves(other), f"{other} on its way again")
        self._give("override", robot, "100")

    def _until(self, condition: Callable[[], bool], what: str) -> None:
        wait_until(condition, 20.0, f"{what}; given {self.given}")


def _start(room: LiveCell) -> dict[str, Process]:
    processes = {"manager": room.manager()}
    processes |= {gateway: room.gateway(gateway) for gateway in room.settings.gateways}
    return processes | {robot: room.agent(robot) for robot in room.settings.robots}


def _freeze(process: Process) -> None:
    os.kill(process.pid, signal.SIGSTOP)
    try:
        threading.Event().wait(FROZEN_S)
    finally:
        os.kill(process.pid, signal.SIGCONT)


def test_both_programs_end_and_nobody_comes_near_whatever_dies_meanwhile(room: LiveCell) -> None:
    processes = _start(room)
    with ExitStack() as stack:
        onlooker = Onlooker(room, stack)
        operator = Operator(room, onlooker)
        for robot in room.settings.robots:
            wait_until(lambda r=robot: onlooker.mode_of(r) is Mode.DISABLED, 60.0, f"{robot} claimed")
        operator.run("left")
        operator.until(lambda: onlooker.stands_inside("left"), 60.0, "left inside")
        operator.run("right")
        operator.until(lambda: onlooker.says("right", _FOR_ROOM), 60.0, "right, waiting for left")
        operator.let_out()
        operator.until(lambda: not onlooker.stands_inside("left"), 60.0, "left, told to leave")
        processes["manager"].signal(signal.SIGKILL)
        processes["manager"].wait(5.0)
        wait_until(lambda: onlooker.all_say("the manager is silent"), 10.0, "both at rest on their paths")
        manager = room.manager()

        operator.until(lambda: onlooker.moves("left"), 60.0, "left on its way again")
        _freeze(processes["left"])
        operator.until(lambda: onlooker.moves("right"), 60.0, "right on its way again")
        _freeze(manager)
        operator.until(lambda: onlooker.moves("right"), 60.0, "right on its way after the manager")
        _freeze(processes[room.settings.robots["left"].gateway])

        operator.until(lambda: onlooker.moves("right"), 60.0, "right on its way after the gateway")
        processes["right"].signal(signal.SIGKILL)
        processes["right"].wait(5.0)
        boot = onlooker.boot_of("right")
        room.agent("right")
        wait_until(lambda: onlooker.boot_of("right") not in ("", boot), 30.0, "the new agent of right")
        operator.until(lambda: all(map(onlooker.done, room.settings.robots)), 60.0, "the end of both programs")
    assert onlooker.nearest_m < NEAR_M, "they never came near each other: the test shows nothing"
