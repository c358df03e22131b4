"""`cell report`: what a recording says, in numbers and as a page."""

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cell.commands.errors import CommandError, not_installed
from cell.commands.files.recordings import RecordingArgument, opened

if TYPE_CHECKING:
    from cell.recording.summary import Summary


def report(
    recording: RecordingArgument,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="OUT.html",
            help="Also a page that any browser opens, offline.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Print what each robot did, who waited for whom and how long, the smallest distances, lateness and alarms."""
    with opened(recording, "cell report") as recorded:
        from cell.recording.summary import TOLD_BY, summary

        told = ((recorded.message(raw), raw.at) for raw in recorded.raw() if raw.kind in TOLD_BY)
        found = summary(told, recorded.began)
        title = f"cell {recorded.cell}, {_time(found.began)} to {_time(found.ended)}"
        cut = " (cut off)" if recorded.cut else ""
    lines = report_lines(found)
    if not found.modes and not found.zones:
        raise CommandError(f"{recording} has nothing to report: no robot and no manager is heard in it")
    print(f"{title}{cut}", *lines, sep="\n")
    if output is not None:
        try:
            from cell.commands.files.report_page import report_page
            from cell.commands.pages.page import write_page
        except ImportError as error:
            raise not_installed("the page of cell report", "view", error) from error
        write_page(output, report_page(title, lines, found))


def report_lines(found: "Summary") -> list[str]:
    """All numbers, for people."""
    lines = [f"robot {robot}: {_shares(use)}" for robot, use in found.use.items()]
    for (robot, what, by), (times, seconds) in found.waited().items():
        whom = f" that {by} has" if by else ""
        lines.append(f"robot {robot} waited {seconds:.1f} s for {what}{whom}, {times} time{'s' if times > 1 else ''}")
    for (one, other), curve in found.distances.items():
        least = min(range(len(curve.y)), key=curve.y.__getitem__)
        lines.append(f"{one} and {other} came as near as {1000.0 * curve.y[least]:.0f} mm, at {_time(curve.x[least])}")
    for gateway, (late, ticks) in found.late_cycles.items():
        worst = 1000.0 * max(found.lateness[gateway].y)
        lines.append(f"gateway {gateway}: {late} of {ticks} cycles late, the worst since its start by {worst:.1f} ms")
    lines += [f"{_time(at)} alarm: {event.source}: {event.text} [{event.code}]" for at, event in found.alarms]
    return lines


def _shares(use: dict[str, float]) -> str:
    total = sum(use.values())
    ordered = sorted(use.items(), key=lambda each: -each[1])
    return ", ".join(
        f"{what} {seconds:.1f} s ({100.0 * seconds / total:.0f} %)" for what, seconds in ordered if seconds
    )


def _time(at: float) -> str:
    return datetime.fromtimestamp(at, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
