"""A cell of two arms as the page hears of it, message by message."""

from dataclasses import replace

import numpy as np

from cell.config import load_cell
from cell.core import Arrived
from cell.messages import (
    Body,
    BusCounters,
    GatewayState,
    GovernorStatus,
    ManagerState,
    Mode,
    Presence,
    ProgramState,
    ProgramStatus,
    RobotState,
    Sections,
    ZoneState,
    ZoneStatus,
)
from cell.view.newest import Newest
from tests.unit.repository import ROOT

CELL = load_cell(ROOT / "cell_configs" / "two_arms" / "cell.yaml")
COUNTERS = BusCounters(1000, 2, 0.001, 0, 0, 0, 0.25)
UPRIGHT = np.array([[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]], np.float32)


def robot(name: str = "left", mode: Mode = Mode.RUNNING, waiting_for: str = "") -> RobotState:
    program = ProgramStatus(f"{name}.prog", ProgramState.RUNNING, 8, "ML X=1650")
    place = (1.0, 0.0, 0.5), (0.0, 0.0, 0.0, 1.0)
    state = RobotState(name, "b", 1, mode, program, (0.0,) * 6, *place, 0.25, GovernorStatus(1.0, 0.4, 2.0, ""))
    return replace(state, waiting_for=waiting_for)


def gateway(name: str = "left_bus", interface: str = "virtual") -> GatewayState:
    return GatewayState(name, "g", 1, 0.004, interface, True, "", {}, None, (), COUNTERS)


def manager(**zones: ZoneStatus) -> ManagerState:
    return ManagerState("two_arms", "m", 7, 1, 10.0, "d", zones=zones)


def held_by(holder: str | None, state: ZoneState = ZoneState.OCCUPIED) -> ZoneStatus:
    return ZoneStatus(state, holder, None, (), 1, 0.0)


def presence(name: str, x: float, poses: int = 1, known: bool = True) -> Presence:
    """An upright capsule of radius 0.1 m at `x` [m], that goes 0.1 m along X from pose to pose."""
    shift = np.zeros((poses, 1, 1, 3), np.float32)
    shift[:, 0, 0, 0] = x + 0.1 * np.arange(poses)
    tcp = shift[:, 0, 0] + np.float32([0.0, 0.0, 1.0])
    radii, growth = np.full(1, 0.1, np.float32), np.zeros(poses, np.float32)
    body = Body(known, (x, 0.0, 0.0), 2.0, radii, UPRIGHT + shift, growth, tcp)
    return Presence(name, "b", 1, 1, None, "d", body, 0.5 if poses > 1 else 0.0)


def seen(*messages: object, now: float = 10.0) -> Newest:
    newest = Newest()
    newest.look([Arrived(each, now) for each in messages], now)
    return newest


def pieces(ids: range | list[int], y: float = 0.0) -> Sections:
    """Upright capsules of radius 0.1 m, piece `i` at 0.2 m times `i` along X."""
    points = np.zeros((len(ids), 1, 2, 3), np.float32)
    points[..., 0], points[..., 1], points[..., 1, 2] = 0.2 * np.array(ids)[:, None, None], y, 1.0
    return Sections(np.array(ids, np.uint64) + np.uint64(1), points, np.full((len(ids), 1), 0.1, np.float32))
