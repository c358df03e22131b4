"""The exit code of `cell status`."""

import pytest

from cell.commands.client.cell_view import Snapshot
from cell.commands.operator.status import FAULTY, STOPPED, exit_code
from cell.messages import Estop, ManagerState, Mode, ProgramState, ProgramStatus, RobotState

PROGRAM = ProgramStatus("p", ProgramState.LOADED, 1, "")


def seen(mode: Mode, *estops: Estop) -> Snapshot:
    robot = RobotState("left", "b", 1, mode, PROGRAM, None, None, None, None, None)
    return Snapshot(robots={"left": robot}, manager=ManagerState("c", "m", 1, 1, 0.0, "digest", estops=estops))


@pytest.mark.parametrize(
    ("snapshot", "code"),
    [
        (seen(Mode.DISABLED), 0),
        (seen(Mode.FAULT), FAULTY),
        (seen(Mode.ESTOP), STOPPED),
        (seen(Mode.FAULT, Estop("e1", True, "joe", "door open")), STOPPED),
        (seen(Mode.READY), 0),
    ],
)
def test_a_latched_stop_and_a_fault_have_exit_codes_of_their_own(snapshot: Snapshot, code: int) -> None:
    assert exit_code(snapshot) == code
