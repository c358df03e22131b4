"""What the page asks of a running cell, and what is kept back."""

from unittest.mock import create_autospec

import pytest

from cell.commands.client.connection import Connection
from cell.commands.client.live_desk import LiveDesk
from cell.commands.errors import CommandError
from cell.messages import Command, Go, Halt, Heard, Jog, JogFrame, Presence
from cell.net.session import CellSession
from cell.view.desk import NoAnswer


@pytest.mark.parametrize("command", [Jog("press", "X", 0.1, JogFrame.BASE), Go("press", "pick")])
def test_no_jog_goes_to_an_agent_that_runs_with_other_files(command: Command) -> None:
    operator = create_autospec(Connection, instance=True)
    operator.session = create_autospec(CellSession, instance=True)
    operator.presence.return_value = create_autospec(Presence, instance=True, digest="another")
    operator.check_files.side_effect = CommandError("robot/left runs with the configuration another", "use its files")
    with pytest.raises(NoAnswer, match="runs with the configuration another; nothing was sent; use its files"):
        LiveDesk(operator, "by the page").ask("robot/left", command, Heard("b", 1))
    operator.check_files.assert_called_once_with("robot/left", "another")
    operator.session.ask.assert_not_called()


def test_a_halt_goes_out_whatever_the_files_are() -> None:
    operator = create_autospec(Connection, instance=True)
    operator.session = create_autospec(CellSession, instance=True)
    operator.stop = None
    LiveDesk(operator, "by the page").ask("robot/left", Halt(), Heard("b", 1))
    operator.check_files.assert_not_called()
    operator.session.ask.assert_called_once()
