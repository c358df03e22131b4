"""The page of a report: bars over time and curves, drawn by plotly, whose script is in the page."""

from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from html import escape
from itertools import cycle

import plotly.graph_objects as plot

from cell.commands.pages.page import COLOURS, page
from cell.recording.summary import Curve, Span, Summary

_COLOURS = {
    "running": "#2e8b57", "moves": "#2e8b57", "waits": "#e0a030", "halted": "#e0a030", "ready": "#9fc5e8",
    "disabled": "#cccccc", "fault": "#c0392b", "estop": "#c0392b", "off_path": "#d35400",
    "free": "#d9ead3", "granted": "#6fa8dc", "occupied": "#e0a030", "orphaned": "#c0392b",
}  # fmt: skip


def report_page(title: str, lines: list[str], found: Summary) -> str:
    """The HTML text. Bars are named in their hints, and a click on a name in the legend hides them."""
    over_time = [
        _bars("Modes", found.modes),
        _bars("Who waited, for what and for whom", found.waits),
        _bars("Zones", found.zones),
        _curves("Distance of the robots [mm]", {" and ".join(pair): c for pair, c in found.distances.items()}),
        _curves("Worst lateness of a cycle so far [ms]", found.lateness),
    ]
    for figure in over_time:
        figure.update_xaxes(range=[_utc(found.began), _utc(found.ended)])
    figures = [*over_time[:3], _use(found), *over_time[3:]]
    for figure in figures:
        figure.update_layout(
            margin={"l": 100, "r": 20, "t": 90}, legend={"orientation": "h", "y": 1.02, "yanchor": "bottom"}
        )
    return page(title, lines, [figure for figure in figures if figure.data])


def _bars(title: str, lines: Mapping[str, Iterable[Span]]) -> plot.Figure:
    """One line of bars for each name."""
    figure = plot.Figure()
    named: dict[str, list[tuple[str, Span]]] = {}
    for name, spans in lines.items():
        for span in spans:
            named.setdefault(span.what, []).append((name, span))
    others = cycle(COLOURS)
    for what, bars in named.items():
        figure.add_bar(
            name=what,
            orientation="h",
            y=[name for name, _ in bars],
            base=[_utc(span.begin) for _, span in bars],
            x=[1000.0 * span.seconds for _, span in bars],
            marker_color=_COLOURS.get(what) or next(others),
            customdata=[[span.by or "nobody", f"{span.seconds:.2f}"] for _, span in bars],
            hovertemplate="%{y}: " + escape(what) + ", %{customdata[1]} s, %{customdata[0]}<extra></extra>",
        )
    height = 160 + 40 * len(lines)
    figure.update_layout(title=title, barmode="overlay", height=height, xaxis_type="date", showlegend=True)
    return figure


def _use(found: Summary) -> plot.Figure:
    figure = plot.Figure()
    for what in dict.fromkeys(what for use in found.use.values() for what in use):
        seconds = [use.get(what, 0.0) for use in found.use.values()]
        shares = [
            100.0 * part / max(sum(use.values()), 1e-9) for part, use in zip(seconds, found.use.values(), strict=True)
        ]
        figure.add_bar(name=what, orientation="h", y=list(found.use), x=shares, marker_color=_COLOURS.get(what))
    figure.update_layout(title="What each robot did [%]", barmode="stack", height=160 + 40 * len(found.use))
    return figure


def _curves(title: str, curves: Mapping[str, Curve]) -> plot.Figure:
    figure = plot.Figure()
    for name, curve in curves.items():
        x = [_utc(at) for at in curve.x]
        figure.add_scatter(name=name, x=x, y=[1000.0 * value for value in curve.y], mode="lines")
    figure.update_layout(title=title, height=320, showlegend=True)
    return figure


def _utc(at: float) -> datetime:
    return datetime.fromtimestamp(at, UTC)
