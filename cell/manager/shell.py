"""The process around `ManagerCore`: Zenoh, the journal, the events that are kept, and the clock."""

import logging
import os
import threading
import time
from contextlib import ExitStack
from pathlib import Path

from cell.config.settings import CellSettings
from cell.core import Answer, Effect, Publish, Request
from cell.manager.core import ManagerCore
from cell.manager.edits_on_disk import EditsOnDisk
from cell.manager.event_recorder import EventRecorder
from cell.manager.event_store import EVENTS_FILE
from cell.manager.frames import WriteFrame
from cell.manager.journal import Journal, JournalWriter
from cell.manager.records import Store
from cell.manager.zone_changes import WriteZone
from cell.messages import Call, Event, ListEvents
from cell.net.errors import NetError
from cell.net.liveliness import TokenWatch
from cell.net.options import Link, ZenohOptions
from cell.net.runner import Priority, new_boot, run_core, scheduling
from cell.net.session import CellSession

JOURNAL_FILE = "manager.sqlite3"
PERIOD_S = 0.02
"""At the latest: what robots and gateways say, and an emergency stop, is looked at when it comes."""
_LOOK_AROUND_S = 0.3
_LOG = logging.getLogger("cell.manager")


class SecondManager(NetError):
    """Another manager of this cell is alive."""

    def __init__(self, cell: str, boot: str) -> None:
        super().__init__(f"cell {cell} has a manager already (boot {boot}); a cell has exactly one: stop it first")
        self.cell = cell
        self.boot = boot


def run_manager(settings: CellSettings, options: ZenohOptions, state_dir: Path, stop: threading.Event) -> int:
    """Run the manager of a cell until `stop` is set; returns 0.

    The caller holds the lock on `state_dir`. Raises `EndpointInUse`, `SecondManager` and `JournalError`.
    """
    boot = new_boot()
    link = Link("peer", listen=(settings.manager_endpoint,), gossip=True)
    with ExitStack() as stack:
        # Zenoh's threads start here: on a busy host a robot that asks for room must not wait until they are served.
        with scheduling(Priority.FEEDING):
            session = stack.enter_context(CellSession(settings.name, link, "manager", "manager", boot, options))
        journal = stack.enter_context(Journal(state_dir / JOURNAL_FILE))
        tokens = session.token_watch()
        _be_the_only_one(settings.name, tokens, stop)
        writer = JournalWriter(journal)
        shell = ManagerShell(session, tokens, writer)
        recorder = EventRecorder(state_dir / EVENTS_FILE, session.queue("event/**"), boot)
        stored = journal.read()
        core = ManagerCore(settings, boot, journal.begin_epoch(boot), stored, os.getpid())
        session.tell_last("frame/*")
        session.tell_last("zone/*")
        session.tell_last("manager/variables")
        session.declare_alive()
        _LOG.info("cell %s: manager at %s, journal %s", settings.name, ", ".join(session.endpoints), journal.path)

        def inbox() -> list[object]:
            for effect in recorder.effects():
                perform(effect)
            messages = []
            for message in shell.inbox():
                if isinstance(message, Request) and _about_events(message):
                    recorder.ask(message)
                else:
                    messages.append(message)
            return messages

        def perform(effect: Effect) -> None:
            shell.perform(effect)
            if isinstance(effect, Publish) and isinstance(effect.message, Event):
                recorder.tell(effect.message)

        with recorder, writer:
            run_core(
                core,
                period_s=PERIOD_S,
                inbox=inbox,
                perform=perform,
                stop=stop,
                on_late=_late,
                soon=shell.soon,
                priority=Priority.MANAGER,
            )
    return 0


def _about_events(request: Request) -> bool:
    return isinstance(request.call, Call) and isinstance(request.call.command, ListEvents)


class ManagerShell:
    """What the manager hears, and how each effect of its core is carried out."""

    def __init__(self, session: CellSession, tokens: TokenWatch, writer: JournalWriter) -> None:
        self._session = session
        self._tokens = tokens
        self._writer = writer
        self._edits = EditsOnDisk()
        self.soon = threading.Event()
        """Something has come that somebody waits for."""
        states = ("robot/*/planned_way", "robot/*/presence", "gateway/*/state", "robot/*/variables")
        self._states = session.watch(*states, came=self.soon)
        self._estops = session.queue("estop", came=self.soon)
        self._calls = session.serve("manager")

    def inbox(self) -> list[object]:
        """Everything that arrived since the last step."""
        heard = [*self._estops.take(), *self._states.take_new(), *self._tokens.take(), *self._calls.take()]
        return [*heard, *self._writer.news(), *self._edits.news()]

    def perform(self, effect: Effect) -> None:
        """Carry one effect out."""
        match effect:
            case Publish(message):
                self._session.publish(message)
            case Answer():
                self._calls.answer(effect)
            case Store(record):
                self._writer.store(record)
            case WriteFrame() | WriteZone():
                self._edits.write(effect)
            case _:
                raise TypeError(f"the manager has no {type(effect).__name__}")


def _late(lateness_s: float) -> None:
    if lateness_s > 0.1:
        _LOG.warning("the manager's cycle was %.0f ms late", 1000 * lateness_s)


def _be_the_only_one(cell: str, tokens: TokenWatch, stop: threading.Event) -> None:
    """Tokens of others come within the first links' moments; with no link there is nobody to disagree with."""
    deadline = time.monotonic() + _LOOK_AROUND_S
    while time.monotonic() < deadline and not stop.wait(PERIOD_S):
        other = next((alive for alive in tokens.alive() if alive.role == "manager"), None)
        if other is not None:
            raise SecondManager(cell, other.boot)
