"""What the page says of the orders that are given on it."""

from types import SimpleNamespace
from unittest.mock import MagicMock, create_autospec

import viser

from cell.config.settings import CellSettings
from cell.view.control import Control
from cell.view.controls import Controls
from cell.view.desk import Desk
from cell.view.gate import Level
from cell.view.newest import Newest
from cell.view.server import Here


def test_an_emergency_stop_is_sent_only_once_its_doors_say_so() -> None:
    client = create_autospec(viser.ClientHandle, instance=True, gui=MagicMock())
    answers = client.gui.add_html.return_value = SimpleNamespace(content="")
    here = create_autospec(Here, instance=True, visitor=SimpleNamespace(level=Level.OPERATE))
    desk = create_autospec(Desk, instance=True)
    control = create_autospec(Control, instance=True, holder=None)
    settings = create_autospec(CellSettings, instance=True)
    controls = Controls(client, MagicMock(), here, control, desk, settings, {}, Newest())
    pressed = client.gui.add_button.return_value.on_click.call_args_list[0].args[0]
    pressed(None)
    controls.show()
    assert "sending an emergency stop" in answers.content
    assert "stop sent" not in answers.content
    desk.stop_all.call_args.args[0]("NO emergency stop was sent")
    controls.show()
    assert "NO emergency stop was sent" in answers.content
