"""`cell replay`: a recorded cell on the screen, as if it ran."""

import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from cell.commands.client.cell_view import POLL_S, Listening
from cell.commands.client.display import Show
from cell.commands.client.json_lines import status_lines
from cell.commands.client.page_server import LOCAL, axes_of, meshes_of, page_server, programs_of
from cell.commands.client.state_table import cell_table
from cell.commands.errors import CommandError
from cell.commands.files.recordings import RecordingArgument, opened
from cell.commands.options import PORT, JsonOption, PortOption
from cell.commands.processes.stop import stop_event
from cell.config.load import load_cell_alone
from cell.config.problem import ConfigError
from cell.config.settings import CellSettings
from cell.messages import Event
from cell.view.gate import Level
from cell.view.meshes import RobotMeshes
from cell.view.rows import Axes

if TYPE_CHECKING:
    from cell.recording.reader import Recorded

END = "end"
NO_TERMINAL_WIDTH = 10_000
"""What is read by programs is not wrapped."""


def replay(
    recording: RecordingArgument,
    speed: Annotated[float, typer.Option(min=0.01, max=1000.0, help="2: twice as fast as it was.")] = 1.0,
    begin: Annotated[
        float, typer.Option("--from", metavar="SECONDS", help="After its begin; below 0: before its end.")
    ] = 0.0,
    at: Annotated[
        str | None,
        typer.Option(metavar="SECONDS", help="Only how the cell was then; `end`: as it was last.", show_default=False),
    ] = None,
    as_json: JsonOption = False,
    view: Annotated[
        bool,
        typer.Option("--view", help="Show it in the browser as `cell view` shows a running cell, and wind it there."),
    ] = False,
    port: PortOption = PORT,
) -> None:
    """Show a recorded cell as `cell status --watch` shows a running one, until its end or Ctrl-C.

    With `--json` its last state, or that of `--at`, as `cell status --json` tells it.
    """
    if view and (at is not None or as_json):
        raise CommandError("--view beside --at or --json", "leave them out; the page winds to any moment")
    stop = stop_event()
    with opened(recording, "cell replay") as recorded:
        from cell.recording.replay import Replay

        player = Replay(recorded, speed, time.monotonic)
        listening = Listening(recorded.settings)
        if at is not None or as_json:
            player.seek(_moment(at or END, player.began, player.ends))
            for arrived in player.take_new():
                listening.hear(arrived.message, arrived.at)
            _once(recorded.settings, listening, player.now(), as_json)
            return
        if view:
            player.seek(begin + (player.began if begin >= 0.0 else player.ends))
            with page_server(LOCAL[0], port, Level.WATCH) as server:
                from cell.view.page import Page

                axes, programs, meshes = _from_files(recorded)
                wound = player, speed
                Page(server, recorded.settings, player, axes, player=wound, programs=programs, meshes=meshes).run(stop)
            return
        player.seek(begin + (player.began if begin >= 0.0 else player.ends))
        with Show(recorded.settings, Console()) as shown:
            while not stop.is_set() and not player.ended:
                for arrived in player.take_new():
                    listening.hear(arrived.message, arrived.at)
                    if isinstance(arrived.message, Event):
                        shown.say(_event_line(arrived.message, arrived.at))
                shown.update(listening.snapshot(player.now()), last=player.ended)
                stop.wait(POLL_S)
        if player.ended:
            print(f"{recording} ends here{': it was cut off' if recorded.cut else ''}")


def _from_files(
    recorded: "Recorded",
) -> tuple[dict[str, Axes], dict[str, tuple[str, ...]], dict[str, RobotMeshes]]:
    """Axes, programs and looks of the robots, by the files in the recording."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            settings = load_cell_alone(recorded.unpack(Path(folder)))
            axes = axes_of(settings)
            return axes, programs_of(settings), meshes_of(settings, axes)
        except (ConfigError, OSError) as error:
            typer.echo(f"axes, programs and meshes are not shown: {error}", err=True)
            return {}, {}, {}


def _moment(at: str, began: float, ends: float) -> float:
    """Seconds since 1970 of what `--at` says. Raises `CommandError`."""
    if at == END:
        return ends
    try:
        seconds = float(at)
    except ValueError:
        seconds = -1.0
    if not 0.0 <= seconds <= ends - began:
        raise CommandError(f"--at {at!r} found, allowed are 0 to {ends - began:.1f} s, and {END}")
    return began + seconds


def _once(settings: CellSettings, listening: Listening, now: float, as_json: bool) -> None:
    seen = listening.snapshot(now)
    if as_json:
        print(*status_lines(settings, seen), sep="\n")
        return
    console = Console()
    width = console.width if console.is_terminal else NO_TERMINAL_WIDTH
    console.print(cell_table(settings, seen, width), soft_wrap=not console.is_terminal)


def _event_line(event: Event, at: float) -> str:
    when = datetime.fromtimestamp(at, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    return f"{when} {event.severity.value}: {event.source}: {event.text} [{event.code}]"
