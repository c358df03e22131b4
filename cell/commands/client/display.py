"""How a running cell is shown for a while: a live table on a terminal, one line per change elsewhere."""

import re
import time
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.live import Live

from cell.commands.client.cell_view import Snapshot
from cell.commands.client.state_table import cell_table, robot_line
from cell.config.settings import CellSettings

PERIOD_S = 0.2
_SECONDS = re.compile(r"[\d.]+ s\b")


class Show:
    """A context manager; `say` prints a line in either form."""

    def __init__(self, settings: CellSettings, console: Console) -> None:
        self._settings = settings
        self._console = console
        self._live = Live(console=console, auto_refresh=False) if console.is_terminal else None
        self._lines: dict[str, str] = {}
        self._due = 0.0
        self._anyone = False

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        if self._live is not None:
            self._live.stop()

    def say(self, text: str) -> None:
        self._console.print(text, markup=False, highlight=False, soft_wrap=True)

    def update(self, seen: Snapshot, last: bool = False) -> None:
        """Show `seen`; at most every `PERIOD_S`, so it may be called as often as the cell is looked at.

        `last` is shown in any case. A cell of which nobody was heard yet is no news.
        """
        now = time.monotonic()
        self._anyone = self._anyone or bool(seen.robots)
        if (now < self._due and not last) or not self._anyone:
            return
        self._due = now + PERIOD_S
        if self._live is not None:
            self._live.update(cell_table(self._settings, seen, self._console.width), refresh=True)
            return
        for robot in self._settings.robots:
            line = robot_line(robot, seen.robots.get(robot))
            without_countdown = _SECONDS.sub("", line)
            if self._lines.get(robot) != without_countdown:
                self._lines[robot] = without_countdown
                self.say(line)
