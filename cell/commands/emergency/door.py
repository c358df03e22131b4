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
DOOR_S = 0.8
"""A door that does not open within this is told; with the command's start, the error of none is out within 1 s."""
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
    """Sends `stop` to `cells` through `endpoint` until it is closed; when nobody of them is there, to all that are."""

    def __init__(
        self, endpoint: str, cells: tuple[str, ...], stop: Stop, answers: Answers, on_sent: Callable[[], None]
    ) -> None:
        self.endpoint = endpoint
        self.sent = False
        """A stop went out here."""
        self.others: tuple[str, ...] = ()
        """The cells that are stopped besides, because nobody is there of those that were named."""
        self.problem = ""
        """Why none has, where that is known."""
        self._cells = cells
        self._stop = stop
        self._answers = answers
        self._on_sent = on_sent
        self._end = threading.Event()
        self._news = threading.Event()
        """The door is closed, or it is known who is there: there is no reason to wait."""
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    @property
    def state(self) -> str:
        """What became of the stop here, as words after "sent through" or as a sentence of their own."""
        if self.sent:
            return self.endpoint + (f" to all cells that are there: {', '.join(self.others)}" if self.others else "")
        return f"nobody answers at {self.endpoint}" + (f" ({self.problem})" if self.problem else "")

    def close(self) -> None:
        """Send no more; `join` waits for the end."""
        self._end.set()
        self._news.set()

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
        listening: dict[str, object] = {}
        there: _There | None = None
        while not self._end.is_set():
            cells = (*self._cells, *self.others)
            for cell in cells:
                self._send(session, cell)
            for cell in cells:
                if cell not in listening:
                    listening[cell] = self._listen_and_ask(session, cell)
            if there is None:
                there = _There(session, self._news)
            elif there.known and not there.cells:
                self.problem = "no cell is alive there"
                there = None
            elif there.known and not there.cells & {*self._cells} and (new := there.cells - {*cells}):
                self.others = (*self.others, *sorted(new))
                continue
            self._news.wait(PERIOD_S)
            self._news.clear()

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


class _There:
    """The cells whose processes are alive behind a door: asked for without waiting. Filled by Zenoh's threads."""

    def __init__(self, session: zenoh.Session, news: threading.Event) -> None:
        self.cells: set[str] = set()
        self.known = False
        """All have answered, or their time is over; `news` is set then."""
        self._news = news
        callback = Callback(self._token, drop=self._over, indirect=False)
        session.liveliness().get("cell/*/alive/**", callback, timeout=OPEN_S)

    def _token(self, reply: zenoh.Reply) -> None:
        if reply.ok is not None:
            self.cells.add(str(reply.ok.key_expr).split("/")[1])

    def _over(self) -> None:
        self.known = True
        self._news.set()
