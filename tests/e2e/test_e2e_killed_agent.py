"""An agent dies in the middle of a line: what its robot does is read off the CAN bus."""

import signal

import numpy as np
import pytest
from can_recorder import CanRecorder, Cycle
from live_cell import LiveCell, Process, Recorder, change, wait_until
from numpy.typing import NDArray
from shared_bus import SHARED_BUSES, move_left_bus_to

from cell.messages import ManagerState, Mode, ProgramState, RobotState, ZoneState
from drive_gateway.config import load_drives
from robot_agent.kinematics import Model
from robot_agent.language import MoveJoints, MoveLine, Names, parse_program
from robot_agent.workspace import PlacedRobot

LINE_INTO_ZONE = 9
ON_LINE_M = 10e-6
RECENT_CYCLES = 10


def start_on(bus: str, live: LiveCell) -> dict[str, Process]:
    """Every process by its own command, the left bus where the test can listen."""
    move_left_bus_to(bus, live)
    processes = {
        "manager": live.manager(),
        "left_bus": live.gateway("left_bus"),
        "right_bus": live.gateway("right_bus"),
    }
    return processes | {"left": live.agent("left"), "right": live.agent("right")}


@pytest.mark.parametrize("shared_bus", SHARED_BUSES)
def test_the_robot_stays_on_its_line_and_its_zone_stays_blocked_until_adopted(live: LiveCell, shared_bus: str) -> None:
    live.without_repeats("left")  # right comes to the zone again, whoever was there first
    change(live.settings.robots["left"].program, {"WAIT 0.3\n": "WAIT 2\n"})  # killed late it is in the zone too
    processes = start_on(shared_bus, live)
    left = live.settings.robots["left"]
    gateway = load_drives(live.file.parent / "left_drives.yaml", "left_bus")
    model = PlacedRobot.of(left).model
    with CanRecorder(gateway) as bus, live.client() as session:
        robots, manager = Recorder(session, "robot/*/state"), Recorder(session, "manager/state")
        enable_and_run(live, robots)
        robots.wait_for(
            RobotState,
            lambda s: s.robot == "left" and s.program.line == LINE_INTO_ZONE and inside_at_speed(s),
            60.0,
            "left on its line inside the zone",
        )
        manager.take()
        processes["left"].signal(signal.SIGKILL)
        orphaned = manager.wait_for(
            ManagerState, lambda s: s.zones["handover"].state is ZoneState.ORPHANED, 5.0, "the orphaned zone"
        )
        assert orphaned.zones["handover"].holder == "left"
        old_token = orphaned.zones["handover"].token
        assert old_token is not None
        wait_until(lambda: at_rest(bus.cycles()), 10.0, "set points at rest")

        last_line = set_points_behind_the_start_of_the_line(bus.cycles(), model, left.program.read_text())
        assert len(last_line) > 20
        assert distance_from_lines(last_line, model, left.program.read_text()).max() < ON_LINE_M

        robots.take()
        robots.wait_for(RobotState, lambda s: "orphaned" in s.waiting_for, 60.0, "right, waiting for the zone")
        adopt_and_finish(live, robots, manager, old_token_text=str(old_token))
        follows_its_set_points(bus.cycles())


def inside_at_speed(state: RobotState) -> bool:
    """The flange is past the zone's near side (X -450 mm) and moves fast."""
    assert state.tcp_position_m is not None
    return "handover" in state.zones and state.tcp_position_m[0] > -0.45 and (state.tcp_speed_m_s or 0.0) > 0.3


def enable_and_run(live: LiveCell, robots: Recorder) -> None:
    for robot in live.settings.robots:
        robots.wait_for(
            RobotState, lambda s, r=robot: s.robot == r and s.mode is Mode.DISABLED, 60.0, f"{robot} claimed"
        )
        live.obeyed("enable", robot)
    for robot in live.settings.robots:
        live.obeyed("run", robot)


def adopt_and_finish(live: LiveCell, robots: Recorder, manager: Recorder, old_token_text: str) -> None:
    """A new agent stands in the zone; it may adopt it and only then move."""
    live.agent("left")
    robots.take()
    left = robots.wait_for(
        RobotState, lambda s: s.robot == "left" and s.mode is Mode.READY, 60.0, "the new agent of left"
    )
    manager.take()
    manager.wait_for(
        ManagerState,
        lambda s: "left" in s.heard and s.heard["left"].boot == left.boot,
        10.0,
        "left, heard by the manager",
    )
    adopted = live.order("zone", "adopt", "handover", "left")
    assert adopted.exit_code() == 0, adopted.output
    state = manager.wait_for(
        ManagerState,
        lambda s: s.zones["handover"].holder == "left" and s.zones["handover"].state is ZoneState.OCCUPIED,
        5.0,
        "the adopted zone",
    )
    assert state.zones["handover"].token is not None
    assert str(state.zones["handover"].token) != old_token_text
    live.obeyed("run", "left")
    done: set[str] = set()

    def all_done(message: RobotState) -> bool:
        if message.program.state is ProgramState.DONE:
            done.add(message.robot)
        return done == set(live.settings.robots)

    robots.wait_for(RobotState, all_done, 90.0, "the end of both programs")


def at_rest(cycles: list[Cycle]) -> bool:
    tail = np.array([cycle.commanded for cycle in cycles[-25:]])
    return len(tail) == 25 and not np.isnan(tail).any() and not np.diff(tail, axis=0).any()


def set_points_behind_the_start_of_the_line(cycles: list[Cycle], model: Model, program: str) -> NDArray[np.float64]:
    """All complete set points after the robot stood for the last time at the start of its line, `(m, n)`."""
    start = corners_in(program, model)[0]
    points = np.array([cycle.commanded for cycle in cycles if not np.isnan(cycle.commanded).any()])
    standing = np.linalg.norm(model.forward(points)[:, :3, 3] - start, axis=1) < ON_LINE_M
    return points[int(np.flatnonzero(standing)[-1]) :]


def distance_from_lines(points: NDArray[np.float64], model: Model, program: str) -> NDArray[np.float64]:
    """`(m,)` [m] distance of the flange from the nearest of the lines from the one into the zone on."""
    corners = corners_in(program, model)
    start, end = corners[:-1], corners[1:]
    way = end - start
    offset = model.forward(points)[:, None, :3, 3] - start
    share = np.clip((offset * way).sum(-1) / (way * way).sum(-1), 0.0, 1.0)
    return np.linalg.norm(offset - share[..., None] * way, axis=-1).min(axis=1)


def corners_in(program: str, model: Model) -> NDArray[np.float64]:
    """`(n, 3)` [m] start of the line into the zone, its end and those of the lines after it, from the program text."""
    statements = parse_program(program, "p", Names(model.joint_names)).statements
    (before,) = (s for s in statements if isinstance(s, MoveJoints) and s.line == LINE_INTO_ZONE - 1)
    corners = [model.forward(np.array(before.joints, dtype=float))[:3, 3]]
    for line in statements:
        if isinstance(line, MoveLine) and line.line >= LINE_INTO_ZONE:
            told = zip(line.position_m, corners[-1], strict=True)
            corners.append(np.array([was if new is None else new for new, was in told]))
    return np.array(corners)


def follows_its_set_points(cycles: list[Cycle]) -> None:
    """Every axis goes where the frames tell it to, a few cycles late; a busy machine may lose some of them."""
    whole = [c for c in cycles if not np.isnan(c.commanded).any() and not np.isnan(c.measured).any()]
    commanded = np.array([c.commanded for c in whole])
    measured = np.array([c.measured for c in whole])
    assert np.ptp(commanded, axis=0).min() > 0.05, "the program moves every axis"
    recent = np.lib.stride_tricks.sliding_window_view(commanded, RECENT_CYCLES, axis=0)
    behind = measured[RECENT_CYCLES - 1 :]
    near = (behind > recent.min(axis=-1) - 0.02) & (behind < recent.max(axis=-1) + 0.02)
    assert near.all(axis=1).mean() > 0.99, "an axis does not follow its set points"
