"""Orders of an operator to a running cell, as commands."""

import signal

from live_cell import LiveCell, Recorder, wait_until

from cell.messages import Estop, Mode, RobotState


def moving(state: RobotState) -> bool:
    return (state.tcp_speed_m_s or 0.0) > 0.2


def test_a_halted_robot_goes_on_and_an_emergency_stop_needs_a_reset_and_an_operators_word(live: LiveCell) -> None:
    live.up("--run").wait_for_output("all robots enabled", 60.0)
    with live.client() as session:
        states = Recorder(session, "robot/left/state")
        states.wait_for(RobotState, moving, 30.0, "left moves")
        _stays_on_its_path_and_goes_on(live, states)
        _stands_until_the_operator_says_so(live, states)


def _stays_on_its_path_and_goes_on(live: LiveCell, states: Recorder) -> None:
    live.obeyed("halt", "left")
    at_rest = states.wait_for(
        RobotState, lambda state: state.mode is Mode.HALTED and not state.tcp_speed_m_s, 10.0, "left halted at rest"
    )
    live.obeyed("continue", "left")
    states.wait_for(
        RobotState,
        lambda state: moving(state) and state.program.line >= at_rest.program.line,
        30.0,
        "left goes on from its line",
    )


def _stands_until_the_operator_says_so(live: LiveCell, states: Recorder) -> None:
    stop = live.order("estop", "--reason", "trial")
    assert stop.exit_code() == 0, stop.output
    for who in ("robot left", "robot right", "gateway left_bus", "gateway right_bus"):
        assert f"confirmed: {who}" in stop.output
    assert live.order("run", "left").exit_code() == 1
    reset = live.order("reset")
    assert reset.exit_code() == 0, reset.output
    assert ": trial\n" in reset.output
    states.wait_for(RobotState, lambda state: state.mode is Mode.DISABLED, 10.0, "left disabled")
    live.obeyed("enable", "left")
    states.wait_for(RobotState, lambda state: state.mode is Mode.HALTED, 10.0, "left on its path, at rest")
    live.obeyed("continue", "left")
    # The other robot stays switched off and may stand in the zone: how far left comes is not said.
    states.wait_for(RobotState, lambda state: state.mode is Mode.RUNNING, 30.0, "left goes on")


def test_an_emergency_stop_reaches_everyone_without_a_manager(live: LiveCell) -> None:
    live.up("--run").wait_for_output("all robots enabled", 60.0)
    live.kill(live.pid_of("cell.commands.main", "manager"))
    with live.client_of("left_bus") as session:
        heard = Recorder(session, "estop")
        stop = live.order("estop")
        heard.wait_for(Estop, lambda estop: estop.active, 5.0, "the stop at a gateway")
    assert stop.exit_code() == 0, stop.output
    assert f"nobody answers at {live.settings.manager_endpoint}" in stop.output
    assert "the manager does not confirm" in stop.output
    assert "never replaces a hard-wired emergency stop" in stop.output


def test_who_died_is_named_by_the_status_and_when_the_cell_ends(live: LiveCell) -> None:
    up = live.up()
    up.wait_for_output("all robots enabled", 60.0)
    wait_until(lambda: live.order("status").exit_code() == 0, 20.0, "nothing to complain about")
    live.kill(live.pid_of("robot_agent", "right"))
    up.wait_for_output("robot right was killed by signal 9", 10.0)
    bad = live.order("status")
    assert bad.exit_code() == 1
    assert "silent: robot right" in bad.output
    up.signal(signal.SIGINT)
    assert up.wait(40.0) == 1
    assert "not in order, died or killed: robot right\n" in up.output
