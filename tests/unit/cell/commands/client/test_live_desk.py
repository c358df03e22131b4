"""What the page asks of a running cell, and what is kept back."""

import threading
import time
from types import SimpleNamespace
from typing import Any
from unittest.mock import create_autospec

import pytest
import zenoh

from cell.commands.client import live_desk
from cell.commands.client.connection import Connection
from cell.commands.client.live_desk import LiveDesk
from cell.commands.emergency.answers import Answers
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


def of_cell() -> Any:
    operator = create_autospec(Connection, instance=True)
    operator.settings = SimpleNamespace(
        name="cell", manager_endpoint="manager", gateways={"left_bus": SimpleNamespace(endpoint="gateway")}
    )
    return operator


OPENS_S = {"opens at once": 0.0, "opens later": 0.4, "never opens": 10.0}


@pytest.mark.parametrize(
    ("manager", "gateway", "says"),
    [
        ("opens at once", "opens at once", ["emergency stop sent through manager, gateway, tunnel"]),
        (
            "opens at once",
            "never opens",
            [
                "emergency stop sent through manager, tunnel",
                "emergency stop sent through manager, tunnel; nobody answers at gateway",
            ],
        ),
        (
            "opens later",
            "never opens",
            [
                "NO emergency stop was sent, use the hard-wired emergency stop: "
                "nobody answers at manager; nobody answers at gateway; nobody answers at tunnel",
                "emergency stop sent through manager, tunnel; nobody answers at gateway",
            ],
        ),
    ],
)
def test_what_became_of_a_stop_is_told_by_its_doors(
    monkeypatch: pytest.MonkeyPatch, manager: str, gateway: str, says: list[str]
) -> None:
    class Door:
        def __init__(self, endpoint: str, *_: object) -> None:
            self._endpoint = endpoint
            self._opens_at = time.monotonic() + OPENS_S[gateway if endpoint == "gateway" else manager]

        @property
        def sent(self) -> bool:
            return time.monotonic() >= self._opens_at

        @property
        def state(self) -> str:
            return self._endpoint if self.sent else f"nobody answers at {self._endpoint}"

        def close(self) -> None:
            pass

        def join(self, timeout_s: float) -> None:
            pass

    monkeypatch.setattr(live_desk, "Door", Door)
    monkeypatch.setattr(live_desk, "DOOR_S", 0.2)
    monkeypatch.setattr(live_desk, "_DOORS_OPEN_S", 0.8)
    told: list[str] = []
    with LiveDesk(of_cell(), "by the page", ["tunnel"]) as desk:
        desk.stop_all(told.append)
    assert told == says


def test_a_stop_for_which_no_door_can_be_made_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_desk, "Door", create_autospec(live_desk.Door, side_effect=RuntimeError("no more threads")))
    told: list[str] = []
    with LiveDesk(of_cell(), "by the page") as desk:
        desk.stop_all(told.append)
    assert told == [
        "the emergency stop may not have gone out, use the hard-wired emergency stop: RuntimeError('no more threads')"
    ]


def test_an_operator_who_leaves_at_once_leaves_when_the_stop_has_gone_out(monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    latched = threading.Event()

    class Door:
        def __init__(self, endpoint: str, _cells: object, _stop: object, answers: Answers, _: object) -> None:
            opened.append(endpoint)
            self._answers = answers
            self.sent, self.state = True, endpoint
            threading.Thread(target=self._answer).start()

        def _answer(self) -> None:
            latched.wait(5.0)
            ok = SimpleNamespace(payload=SimpleNamespace(to_bytes=lambda: b'{"ok": true, "text": "latched"}'))
            self._answers.reply(create_autospec(zenoh.Reply, instance=True, ok=ok))

        def close(self) -> None:
            opened.remove("manager" if "manager" in opened else "gateway")

        def join(self, timeout_s: float) -> None:
            assert timeout_s > 0.0

    monkeypatch.setattr(live_desk, "Door", Door)
    operator = of_cell()
    threading.Timer(0.3, latched.set).start()
    began = time.monotonic()
    with LiveDesk(operator, "by the page") as desk:
        desk.stop_all(lambda _: None)
    assert latched.is_set(), "the desk was left before anybody had latched the stop"
    assert time.monotonic() - began < 5.0
    assert not opened
