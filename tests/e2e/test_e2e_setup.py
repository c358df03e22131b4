"""Set-up with real processes: one robot at a time, by the manager's word."""

from live_cell import LiveCell, Recorder, wait_until

from cell.messages import DriveFeedback, ManagerState, Mode, RobotState


def moves(feedback: DriveFeedback) -> bool:
    return bool(abs(feedback.velocity).max() > 0.01)


def begins(heard: Recorder) -> bool:
    return any(isinstance(message, DriveFeedback) and moves(message) for message in heard.take())


def test_while_one_robot_is_set_up_no_other_runs_and_without_a_manager_only_by_the_operators_word(
    live: LiveCell,
) -> None:
    live.up().wait_for_output("all robots enabled", 60.0)
    with live.client() as cell, live.client_of("left_bus") as session:
        heard = Recorder(cell, "manager/state")
        left = Recorder(session, "robot/left/drives")
        live.obeyed("disable", "left")
        for _ in range(5):  # a busy computer may not hear of right in time
            refused = live.order("move", "left", "J1=5", "--by")
            assert refused.exit_code() == 1
            if "agent silent" not in refused.output:
                break
        assert "right is not at rest and switched off: cell disable right" in refused.output
        live.obeyed("disable", "right")
        for _ in range(5):  # a busy computer may let go of the held motion
            move = live.start("cell", "move", "left", "J1=60", "--by", "--speed", "5", "-f", str(live.file))
            heard.wait_for(ManagerState, lambda state: bool(state.setup and state.setup.free), 30.0, "left is free")
            left.take()  # only motion from now on counts
            wait_until(lambda move=move: begins(left) or move.exit_code() is not None, 30.0, "left moves, or is let go")
            enable = live.order("enable", "right")
            if move.exit_code() is None:
                break
            live.order("disable", "right")
        assert "right stays at rest: left is in set-up" in enable.output, move.output
        live.kill(live.pid_of("cell.commands.main", "manager"))
        left.wait_for(DriveFeedback, lambda feedback: not moves(feedback), 3.0, "left stands")
        assert move.wait(10.0) == 1
        alone = live.start("cell", "move", "left", "J1=5", "--by", "--without-manager", "-f", str(live.file))
        left.wait_for(DriveFeedback, moves, 30.0, "left moves without a manager")
        assert alone.wait(60.0) == 0, alone.output


def test_a_gateway_that_dies_in_set_up_is_named_with_its_remedy_and_ends_it_when_it_is_back(live: LiveCell) -> None:
    live.up().wait_for_output("all robots enabled", 60.0)
    live.obeyed("disable", "left")
    live.obeyed("disable", "right")
    with live.client() as session:
        heard = Recorder(session, "manager/state", "robot/right/state")
        move = live.start("cell", "move", "left", "J1=60", "--by", "--speed", "10", "-f", str(live.file))
        heard.wait_for(ManagerState, lambda state: bool(state.setup and state.setup.free), 30.0, "left is free")
        live.kill(live.pid_of("cell.commands.drive_gateway", "left_bus"))
        assert move.wait(30.0) == 1
        silent = heard.wait_for(
            ManagerState, lambda state: bool(state.setup and "is silent" in state.setup.reason), 5.0, "it is told"
        )
        assert silent.setup is not None
        assert "cell setup clear left" in silent.setup.reason
        live.gateway("left_bus")
        heard.wait_for(ManagerState, lambda state: state.setup is None, 30.0, "the set-up is over")
        wait_until(lambda: live.order("enable", "right").exit_code() == 0, 30.0, "right may be enabled")
        heard.wait_for(RobotState, lambda state: state.mode is Mode.READY, 10.0, "right is ready")
