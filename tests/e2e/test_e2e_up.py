"""`cell up`: a whole cell from one command, and its end."""

import signal

from live_cell import LiveCell, Recorder, wait_until

from cell.messages import ManagerState, Mode, RobotState

UP_S = 60.0


def test_ctrl_c_brakes_on_the_path_before_anything_ends(live: LiveCell) -> None:
    up = live.up("--until-done")
    up.wait_for_output("all robots enabled", UP_S)
    with live.client() as session:
        states = Recorder(session, "robot/*/state")
        robots = set(live.settings.robots)
        running: set[str] = set()
        halted: set[str] = set()

        def all_run_and_one_is_fast(state: RobotState) -> bool:
            if state.mode is Mode.RUNNING:
                running.add(state.robot)
            return running == robots and (state.tcp_speed_m_s or 0.0) > 0.3

        def all_halted_at_rest(state: RobotState) -> bool:
            if state.mode is Mode.HALTED and state.tcp_speed_m_s == 0.0:
                halted.add(state.robot)
            return halted == robots

        states.wait_for(RobotState, all_run_and_one_is_fast, 30.0, "a robot that moves fast")
        up.signal(signal.SIGINT)
        states.wait_for(RobotState, all_halted_at_rest, 10.0, "both robots halted at rest")
        assert up.wait(30.0) == 130
    assert "was killed" not in up.output


def test_a_closed_terminal_ends_the_cell_in_order(live: LiveCell) -> None:
    up = live.up("--run")
    up.wait_for_output("all robots enabled", UP_S)
    with live.client() as session:
        states = Recorder(session, "robot/*/state")
        states.wait_for(RobotState, lambda state: (state.tcp_speed_m_s or 0.0) > 0.3, 30.0, "a robot that moves fast")
    up.signal(signal.SIGHUP)
    up.signal(signal.SIGINT)  # and someone is in a hurry
    assert up.wait(30.0) == (1 if "was killed" in up.output else 0), up.output
    assert live.pids() == []
    gateway_log = (live.state_dir / "log" / "gateway-left_bus.log").read_text()
    assert gateway_log.index("was released by its owner") < gateway_log.index("(closing)")


def test_children_end_when_cell_up_is_killed(live: LiveCell) -> None:
    up = live.up("--run")
    up.wait_for_output("all robots enabled", UP_S)
    assert len(live.pids()) == 6
    up.signal(signal.SIGKILL)
    up.wait(5.0)
    wait_until(lambda: not live.pids(), 25.0, "the end of manager, gateways and agents")


def test_an_endpoint_in_use_is_said_with_who_answers_there(live: LiveCell) -> None:
    live.manager()
    with live.client() as session:
        Recorder(session, "manager/state").wait_for(ManagerState, lambda _: True, 30.0, "the manager")
    up = live.start("cell", "up", str(live.file), "--state-dir", str(live.folder / "other"))
    assert up.wait(60.0) == 1
    assert live.settings.manager_endpoint in up.output
    assert "manager" in up.output
    assert "Traceback" not in up.output


def test_a_cell_whose_processes_were_all_killed_did_not_end_in_order(live: LiveCell) -> None:
    up = live.up()
    up.wait_for_output("all robots enabled", UP_S)
    for pid in set(live.pids()) - {up.pid}:
        live.kill(pid)
    assert up.wait(40.0) == 1
    assert up.output.count("was killed by signal 9") == 5
    assert "every process of the cell has ended" in up.output
    assert "not in order, died or killed: manager, gateway left_bus" in up.output
