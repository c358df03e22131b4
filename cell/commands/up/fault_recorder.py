"""`cell up` keeps the last minutes of its cell in memory, and at each alarm a file of them."""

import os
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from cell.commands.client.recorded import SETTLE_S, hear_all, recorded
from cell.config.settings import CellSettings
from cell.messages import STATES, Event, Severity
from cell.net.latest import Decoder
from cell.net.session import CellSession
from cell.recording.errors import RecordingError
from cell.recording.ring import Ring

KEPT_S = 120.0
KEPT_BYTES = 64 * 2**20
"""So much is held in memory."""
AFTER_S = 3.0
"""How long after an alarm the recording goes on."""
MOST_FILES = 20
MOST_BYTES = 2**30
"""Of all files together; the oldest ones go first."""
END_S = 15.0
"""A file that is not written so long after the end of the cell is cut off there."""
PACK_S = 1.0
_POLL_S = 0.05
_NICE = 10


class FaultRecorder:
    """A context manager around a thread that packs the ring and writes files. A full disk stops nothing else."""

    def __init__(
        self,
        settings: CellSettings,
        session: CellSession,
        bulk: CellSession,
        folder: Path,
        hurry: threading.Event,
        say: Callable[[str], None],
    ) -> None:
        """Both sessions: see `hear_all`.

        `folder` gets the files; `hurry` ends the wait for the last of them; `say` is called from the thread too.
        """
        self._settings = settings
        self._decoder = Decoder(session.keys, report=lambda _: None)
        self._folder = folder
        self._hurry = hurry
        self._say = say
        self._ring = Ring(KEPT_S, KEPT_BYTES)
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._events = session.queue("event/**")
        hear_all(session, bulk, lambda key, payload, age_s: self._ring.store(time.time() - age_s, key, payload))

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        self._end.set()
        deadline = time.monotonic() + END_S
        while self._thread.is_alive() and not self._hurry.is_set() and time.monotonic() < deadline:
            self._thread.join(_POLL_S)

    def _run(self) -> None:
        """One file for an alarm and all that follow until it is written."""
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICE)
        alarm, due, ending = None, 0.0, False
        while not ending:
            ending = self._end.wait(PACK_S)
            self._ring.pack(time.time() - (0.0 if ending else SETTLE_S))
            for event in self._events.take():
                if alarm is None and isinstance(event, Event) and event.severity is Severity.ALARM:
                    alarm, due = event, time.monotonic() + AFTER_S
            if alarm is not None and (time.monotonic() >= due or ending):
                self._save(alarm)
                alarm = None

    def _save(self, alarm: Event) -> None:
        from cell.recording.writer import SUFFIX, Recording

        stamp = datetime.now(UTC).strftime("%Y-%m-%dT%H%M%S.%fZ")
        path = self._folder / f"{stamp}-{alarm.source.replace('/', '-')}-{alarm.code}{SUFFIX}"
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            with Recording(path, recorded(self._settings), self._ring.begins()) as recording:
                for at, key, payload in self._ring.told():
                    message = self._decoder.decode(key, payload)
                    if type(message) in STATES:
                        recording.add(message, at)
            make_room(self._folder, SUFFIX)
        except (RecordingError, OSError) as error:
            self._say(f"what happened before the alarm is not kept: {error}")
            return
        self._say(f"what happened before the alarm is kept: cell report {path}")


def make_room(folder: Path, suffix: str) -> None:
    """Remove the oldest recordings while there are too many or too large ones; the newest stays. Raises `OSError`."""
    files = sorted(path for path in folder.iterdir() if path.suffix == suffix)
    sizes = [path.stat().st_size for path in files]
    while len(files) > 1 and (len(files) > MOST_FILES or sum(sizes) > MOST_BYTES):
        files.pop(0).unlink()
        sizes.pop(0)
