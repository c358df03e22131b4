"""A page that shows a cell for half a day."""

import gc
from dataclasses import replace
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser", reason="the group `view` is not installed")

from cell.core import Arrived
from cell.messages import (
    AxisStatus,
    Clearance,
    Deadlock,
    DriveFeedback,
    Event,
    FramePose,
    PlannedWay,
    PlayoutState,
    Refusal,
    Severity,
    ZoneState,
)
from cell.view.gate import Gate, Level
from cell.view.page import PICTURE_S, Page
from cell.view.rows import Axes
from cell.view.server import GatedServer, listen
from tests.unit.cell.view.room import CELL, gateway, held_by, manager, pieces, presence, robot

HOURS = 12
GROWTH_MB = 20.0
AXES = {name: Axes(tuple(f"J{i}" for i in range(1, 7)), (False,) * 6) for name in CELL.robots}


def feedback(name: str, at: float) -> DriveFeedback:
    axes = np.full(6, at)
    enabled = (AxisStatus.OPERATION_ENABLED,) * 6
    return DriveFeedback(
        name, "g", 1, 5, 1, 1, PlayoutState.PLAYING, 9, 0, True, True, axes, axes, axes + 0.001, enabled, axes
    )


class Cell:
    """A cell whose robots move, wait for each other, plan anew and tell events; its clock goes by pictures."""

    def __init__(self) -> None:
        self._pictures = 0
        self._presences = {
            name: cycle([presence(name, 0.01 * x, poses=8) for x in (*range(60), *range(60, 0, -1))]) for name in AXES
        }
        self._feedback = {name: cycle([feedback(name, 0.01 * i) for i in range(100)]) for name in AXES}

    def now(self) -> float:
        return self._pictures * PICTURE_S

    def take_new(self) -> list[Arrived]:
        self._pictures += 1
        number, second = self._pictures, self._pictures // 30
        new: list[object] = [next(each) for each in (*self._presences.values(), *self._feedback.values())]
        if number % 6 == 0:
            new += self._states(second)
        if number % 30 == 0:
            severity = tuple(Severity)[second % 3]
            new.append(Event("robot/left", second, severity, f"code_{second % 7}", f"text {second}" * 5, "do it"))
            new.append(FramePose("table", second, None, (0.001 * second, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
        if number % 90 == 0:
            new += [PlannedWay(name, "b", 1, second, True, pieces(range(second, second + 40))) for name in AXES]
        return [Arrived(each, self.now()) for each in new]

    def _states(self, second: int) -> list[object]:
        zone = tuple(ZoneState)[second // 5 % 4]
        one = manager(handover=held_by("right" if zone is not ZoneState.FREE else None, zone))
        if second % 40 < 5:
            one = replace(one, deadlocks=(Deadlock(("left", "right"), (), 0.0, "both wait", "return left"),))
        waits = "no room" if second % 10 < 5 else ""
        refused = Refusal("right", "no room") if waits else None
        cleared = Clearance("left", "m", 1, 1, 1, second, 3, refused)
        return [robot("left", waiting_for=waits), robot("right"), cleared, one, gateway(), gateway("right_bus")]


def memory_mb() -> float:
    gc.collect()
    return int(Path("/proc/self/status").read_text().split("VmRSS:")[1].split()[0]) / 1024.0


@pytest.mark.soak
@pytest.mark.timeout(3600)
def test_half_a_day_of_messages_leaves_nothing_behind() -> None:
    listener = listen("127.0.0.1", 0)
    server = GatedServer(Gate(("127.0.0.1",), Level.WATCH), listener)
    try:
        page = Page(server, CELL, Cell(), AXES)
        hour, before = round(3600 / PICTURE_S), 0.0
        for turn in range(HOURS * hour):
            page.picture(turn)
            if turn == hour:
                before = memory_mb()
        after = memory_mb()
        print(f"after an hour {before:.1f} MB, after {HOURS} hours {after:.1f} MB")
        assert after - before < GROWTH_MB
    finally:
        server.stop()
