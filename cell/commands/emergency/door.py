"""One way into a cell, in a thread of its own: a stop goes through it as soon as it opens, again and again."""

import json
import os
import threading
from collections.abc import Callable

import zenoh
from zenoh.handlers import Callback

from cell.commands.emergency.answers import Answers
from cell.net.options import Link, ZenohOptions, zenoh_config

OPEN_S = 0.7
"""An attempt to open a door takes this long at most; the next one follows."""
PERIOD_S = 0.05
_ANSWER_S = 5.0


class Stop:
    """An emergency stop as bytes, under an id of its own."""

    def __init__(self, by: str, reason: str) -> None:
        command = {"id": os.urandom(16).hex(), "by": by, "reason": reason}
        self.message = json.dumps({**command, "active": True}).encode()
        """An `Estop`, for the key `estop`."""
        self.call = json.dumps({"id": os.urandom(16).hex(), "command": command, "heard": None}).encode()
        """A `SetEstop`, for the manager: it latches the stop for late-comers and answers who stands."""


class Door:
    """Sends `stop` to `cells` through `endpoint` until it is closed; without known cells, to those that are there."""

    def __init__(
        self, endpoint: str, cells: tuple[str, ...], stop: Stop, answers: Answers, on_sent: Callable[[], None]
    ) -> None:
        self.endpoint = endpoint
        self.sent = False
        """A stop went out here."""
        self.problem = ""
        """Why none has, where that is known."""
        self._cells = cells
        self._stop = stop
        self._answers = answers
        self._on_sent = on_sent
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Send no more; `join` waits for the end."""
        self._end.set()

    def join(self, timeout_s: float) -> None:
        self._thread.join(timeout_s)

    def _run(self) -> None:
        link = Link("client", connect=(self.endpoint,), open_timeout_s=OPEN_S)
        while not self._end.is_set():
            try:
                with zenoh.open(zenoh_config(link, ZenohOptions())) as session:
                    self._use(session)
            except Exception as error:
                text = str(error).split(" at /")[0]
                self.problem = "" if text.startswith("Unable to connect") else text
            self._end.wait(PERIOD_S)

    def _use(self, session: zenoh.Session) -> None:
        cells = self._cells
        listening: dict[str, object] = {}
        while not self._end.is_set():
            cells = cells or _cells_behind(session)
            for cell in cells:
                self._send(session, cell)
            for cell in cells:
                if cell not in listening:
                    listening[cell] = self._listen_and_ask(session, cell)
            if not cells:
                self.problem = "no cell is alive there"
            self._end.wait(PERIOD_S)

    def _send(self, session: zenoh.Session, cell: str) -> None:
        session.put(
            f"cell/{cell}/estop",
            self._stop.message,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.REAL_TIME,
            express=True,
        )
        if not self.sent:
            self.sent = True
            self._on_sent()

    def _listen_and_ask(self, session: zenoh.Session, cell: str) -> object:
        """What must be kept for as long as answers are wanted."""
        subscribers = [
            session.declare_subscriber(f"cell/{cell}/{kind}", Callback(self._answers.state, indirect=False))
            for kind in ("robot/*/presence", "gateway/*/state")
        ]
        self._answers.asked()
        session.get(
            f"cell/{cell}/manager/cmd/estop",
            Callback(self._answers.reply, drop=self._answers.no_more, indirect=False),
            payload=self._stop.call,
            encoding=zenoh.Encoding.APPLICATION_JSON,
            timeout=_ANSWER_S,
            priority=zenoh.Priority.REAL_TIME,
        )
        return subscribers


def _cells_behind(session: zenoh.Session) -> tuple[str, ...]:
    """The cells whose processes are alive behind a door."""
    tokens = session.liveliness().get("cell/*/alive/**", timeout=OPEN_S)
    return tuple({str(token.ok.key_expr).split("/")[1] for token in tokens if token.ok is not None})
