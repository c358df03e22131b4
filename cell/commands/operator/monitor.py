"""`cell monitor`: what the page shows, in a terminal, with the few keys that one wants at once."""

import errno
import sys
import termios
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import Enum
from itertools import islice
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from cell.commands.access import require
from cell.commands.client.cell_view import Snapshot
from cell.commands.client.connection import connect
from cell.commands.client.live_desk import LiveDesk
from cell.commands.client.page_server import axes_of
from cell.commands.client.state_table import footer
from cell.commands.errors import CommandError, quoted
from cell.commands.operator.keyboard import DOWN, UP, Keyboard
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption
from cell.commands.processes.stop import stop_event
from cell.config.settings import CellSettings
from cell.messages import (
    Command,
    Continue,
    Event,
    GatewayState,
    Halt,
    Heard,
    ManagerState,
    Presence,
    RobotState,
    Severity,
)
from cell.view.desk import Desk, NoAnswer
from cell.view.gate import Level
from cell.view.newest import Newest
from cell.view.now import Line, NowLines, Tone
from cell.view.rows import AXIS_HEADING, Axes, Kind, axis_columns, axis_rows, bursts, duration
from cell.view.source import LiveSource, Source

PERIOD_S = 0.25
_TONES = {Tone.MOVES: "green", Tone.WAITS: "yellow", Tone.STANDS: "bright_black", Tone.ALARM: "bold red"}
_DRIVES = _TONES | {Tone.MOVES: ""}
_KINDS = {Kind.SILENT: "bright_black", Kind.SIMULATED: "bold cyan", Kind.REAL: "bold white on red"}
_SEVERITIES = {Severity.INFO: "bright_black", Severity.WARNING: "yellow", Severity.ALARM: "bold red"}
_ANSWERS = 2
"""So many of the last answers are shown."""


class Key(Enum):
    """What a key does, and the words for it at the foot of the screen."""

    HALT = "h", "halt"
    CONTINUE = "c", "continue"
    ESTOP = "e", "EMERGENCY STOP"
    LEAST = "f", "filter events"
    PAUSE = "p", "pause events"
    QUIT = "q", "quit"

    def __init__(self, letter: str, words: str) -> None:
        self.letter = letter
        self.words = words


def monitor(
    control: Annotated[
        bool, typer.Option("--control", help="Take the key for continue, too; to halt and to stop needs no option.")
    ] = False,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Watch the running cell in the terminal: every robot with what to do next, its drives, zones and events.

    Keys: arrows choose a robot; h halts it, c lets it go on (with --control), e stops the whole cell; q ends. The
    emergency stop supports and never replaces a hard-wired one.
    """
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise CommandError("cell monitor needs a terminal", f"for scripts: cell status --json -f {quoted(file)}")
    if control:
        require(Level.OPERATE, "cell monitor --control")
    stop = stop_event()
    with connect(file, endpoint, stop) as operator, LiveDesk(operator, "by the monitor", endpoint or ()) as desk:
        screen = Screen(operator.settings, axes_of(operator.settings), desk, control)
        source = LiveSource(operator.session)
        console = Console()
        with until_hung_up(), Keyboard() as keyboard, Live(console=console, screen=True, auto_refresh=False) as live:
            while not (stop.is_set() or screen.done or keyboard.gone):
                screen.look(source)
                live.update(screen.drawn(console.width, console.height), refresh=True)
                deadline = time.monotonic() + PERIOD_S
                while (left_s := deadline - time.monotonic()) > 0.0 and (key := keyboard.key(left_s)):
                    screen.press(key)


@contextmanager
def until_hung_up() -> Iterator[None]:
    """Ends quietly where the terminal has gone, as when an SSH connection breaks: nobody is left to be told."""
    try:
        yield
    except termios.error as error:
        if error.args[0] != errno.EIO:
            raise
    except OSError as error:
        if error.errno != errno.EIO:
            raise


@dataclass(slots=True)
class Screen:
    """What is shown and chosen. Orders are given in threads of their own: who is asked may take long to answer."""

    settings: CellSettings
    axes: Mapping[str, Axes]
    desk: Desk
    control: bool
    seen: Newest = field(default_factory=Newest)
    done: bool = False
    """An operator wants no more of it."""
    _now: NowLines = field(init=False)
    _robots: tuple[str, ...] = field(init=False)
    _chosen: int = 0
    _least: Severity = Severity.INFO
    _paused: list[tuple[float, Event]] | None = None
    _answers: deque[str] = field(default_factory=lambda: deque(maxlen=_ANSWERS))

    def __post_init__(self) -> None:
        self._now = NowLines(self.settings)
        self._robots = tuple(self.settings.robots)

    def look(self, source: Source) -> None:
        """Take what has come."""
        self.seen.look(source.take_new(), source.now())

    # Keys

    def press(self, pressed: str) -> None:
        """Do what a key says."""
        if pressed in (UP, DOWN):
            self._chosen = (self._chosen + (1 if pressed == DOWN else -1)) % len(self._robots)
            return
        match next((key for key in Key if key.letter == pressed), None):
            case Key.HALT:
                self._order(Halt())
            case Key.CONTINUE if self.control:
                self._order(Continue())
            case Key.CONTINUE:
                self._answers.append("continue: not without --control; nothing was sent")
            case Key.ESTOP:
                self._answers.append("sending an emergency stop; who confirms it is told above")
                self.desk.stop_all(self._answers.append)
            case Key.LEAST:
                severities = list(Severity)
                self._least = severities[(severities.index(self._least) + 1) % len(severities)]
            case Key.PAUSE:
                self._paused = self._events() if self._paused is None else None
            case Key.QUIT:
                self.done = True

    def _order(self, command: Command) -> None:
        """Ask the chosen robot, in view of its state."""
        robot = self._robots[self._chosen]
        state = self.seen.of(RobotState).get(robot)
        if state is None:
            self._answers.append(f"{robot}: its agent does not answer; nothing was sent")
            return
        heard = Heard(boot=state.boot, sequence=state.sequence)

        def ask() -> None:
            try:
                reply = self.desk.ask(f"robot/{robot}", command, heard)
                self._answers.append(f"{robot}{':' if reply.ok else ' refuses:'} {reply.text}")
            except NoAnswer as error:
                self._answers.append(str(error))

        threading.Thread(target=ask, daemon=True).start()

    # Picture

    def drawn(self, width: int, height: int) -> Table:
        """All that fits: robots, the axes of the chosen one, the cell; events take what is left."""
        lines = [*self._head(), *self._robot_lines(width), *self._axis_lines(), *self._cell_lines()]
        foot = [*(Text(answer, "bold") for answer in tuple(self._answers)), self._keys()]
        room = max(0, height - len(lines) - len(foot) - 1)
        shown = [*lines, self._events_heading(), *islice(self._event_lines(), room)]
        shown = shown[: max(0, height - len(foot))]
        table = Table.grid()
        for line in (*shown, *(Text() for _ in range(height - len(shown) - len(foot))), *foot):
            line.truncate(width, overflow="ellipsis")
            table.add_row(line)
        return table

    def _head(self) -> list[Text]:
        kind = Kind.of(self.seen)
        head = [Text.assemble((f" {self.settings.name} ", "bold reverse"), " ", (kind.value, _KINDS[kind]))]
        manager = self.seen.one(ManagerState)
        for estop in manager.estops if manager is not None else ():
            head.append(Text(f"EMERGENCY STOP by {estop.by}: {estop.reason}", "bold white on red"))
        if manager is not None and manager.estops:
            head.append(Text(self._confirmations()))
        return head

    def _confirmations(self) -> str:
        """Who stands under the stop, and who has not said so."""
        presences, gateways = self.seen.of(Presence), self.seen.of(GatewayState)
        told = {name: name in presences and presences[name].estop_acknowledged is not None for name in self._robots}
        told |= {
            f"gateway {name}": name in gateways and gateways[name].estop_confirmed is not None
            for name in self.settings.gateways
        }
        return "  ".join(f"{name} {'stands' if stands else 'HAS NOT CONFIRMED'}" for name, stands in told.items())

    def _robot_lines(self, width: int) -> list[Text]:
        shown = []
        for number, line in enumerate(self._now.of(self.seen)):
            chosen = number == self._chosen
            shown += _robot(line, chosen, width)
        return shown

    def _axis_lines(self) -> list[Text]:
        robot = self._robots[self._chosen]
        if robot not in self.axes:
            return []
        rows = axis_rows(robot, self.axes[robot], self.seen)
        widths = {
            i: max(len(each[i]) for each in (AXIS_HEADING, *(row.cells for row in rows))) for i in axis_columns(rows)
        }

        def aligned(cells: tuple[str, ...], style: str) -> Text:
            return Text("  ".join(f"{cells[i]:{width}}" for i, width in widths.items()), style)

        return [aligned(AXIS_HEADING, "underline"), *(aligned(row.cells, _DRIVES[row.tone]) for row in rows)]

    def _cell_lines(self) -> list[Text]:
        robots, gateways = dict(self.seen.of(RobotState)), dict(self.seen.of(GatewayState))
        manager = self.seen.one(ManagerState)
        lines = footer(self.settings, Snapshot(robots, {}, gateways, manager))
        stuck = [f"{each.text}; {each.remedy}" for each in manager.deadlocks] if manager is not None else []
        return [*map(Text, lines), *(Text(text, "bold red") for text in stuck)]

    def _events_heading(self) -> Text:
        paused = ", PAUSED" if self._paused is not None else ""
        return Text(f"events, {self._least.value} and above{paused}", "underline")

    def _events(self) -> list[tuple[float, Event]]:
        return [(each.at, each.message) for _, each in self.seen.events if isinstance(each.message, Event)]

    def _event_lines(self) -> list[Text]:
        """Newest first; the remedy in a line of its own."""
        severities, lines = list(Severity), []
        newest_first = reversed(self._events() if self._paused is None else self._paused)
        least = severities.index(self._least)
        for burst in bursts((event, at) for at, event in newest_first if severities.index(event.severity) >= least):
            event, when = burst.newest, f"{duration(self.seen.now - burst.at)} ago"
            told = f"{when:>10}  {event.source}{burst.lasted}: {event.text}"
            lines.append(Text(told, _SEVERITIES[event.severity]))
            if event.remedy:
                lines.append(Text(f"{'':12}next: {event.remedy}"))
        return lines

    def _keys(self) -> Text:
        letters = [key for key in Key if self.control or key is not Key.CONTINUE]
        words = "  ".join(f"{key.letter} {key.words}" for key in letters)
        return Text(f" arrows: {self._robots[self._chosen]}  {words} ", "reverse")


def _robot(line: Line, chosen: bool, width: int) -> list[Text]:
    """Three lines, so that nothing jumps: what it does, what keeps it, what to do."""
    style = _TONES[line.tone]
    since = "" if line.since_s is None else f" (for {duration(line.since_s)})"
    first = Text.assemble(
        ("> " if chosen else "  ", "bold"), (f"{line.robot} ", "bold"), (line.mode, style),
        f"  {line.program}", f"  {line.rate}" if line.rate else "",
    )  # fmt: skip
    reason = Text(f"    {line.reason}", style)
    reason.truncate(max(0, width - len(since)), overflow="ellipsis")
    return [first, reason.append(since), Text(f"    next: {line.next}")]
