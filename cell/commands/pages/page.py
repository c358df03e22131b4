"""A page of curves for any browser, offline: drawn by plotly, whose script comes out of its wheel into the page.

Hints read values, a frame zooms, a path in space turns. A click on a line of a program marks its stretches in every
curve over time, and on the path.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np
import plotly.graph_objects as draw
from numpy.typing import NDArray
from plotly.colors import qualitative

from cell.commands.errors import CommandError

COLOURS: tuple[str, ...] = tuple(qualitative.Safe)
_MOST_POINTS = 4000
"""Of a curve: what is more shows nothing more."""
_CONFIG = {
    "displaylogo": False,
    "showSendToCloud": False,
    "modeBarButtonsToRemove": ["sendChartToCloud", "sendDataToCloud"],
}
"""No button that sends what is shown to a service in the network."""
_MARGIN = {"t": 60, "r": 40}
_MARKED, _LIMIT, _END = "#d97706", "#c0392b", "#bbbbbb"
_STYLE = """
body{font:14px system-ui,sans-serif;margin:2em auto;max-width:1100px;padding:0 1em;color:#222}
h1{font-size:1.5em}h2{font-size:1.1em;margin-top:2em}li{margin:.15em 0}
ol.program{font:13px ui-monospace,monospace;list-style:none;padding:0;max-height:24em;overflow:auto;
 border:1px solid #ddd}
ol.program li{padding:.1em .6em;white-space:pre}ol.program li[data-at]{cursor:pointer}
ol.program li[data-at]:hover{background:#f3f3f3}ol.program li.chosen{background:#fde9c8}
ol.program b{display:inline-block;width:3.5em;color:#888;font-weight:400}
"""
_MARK = """
const figures=[...document.querySelectorAll('.js-plotly-plot')],framed=figures.filter(f=>f.layout.meta==='time'),
 ways=figures.filter(f=>f.layout.meta==='way');
framed.forEach(f=>{f.zencellShapes=f.layout.shapes||[]});
function mark(at){
 framed.forEach(f=>Plotly.relayout(f,{shapes:f.zencellShapes.concat(at.map(([a,b])=>({type:'rect',xref:'x',yref:'paper',
  x0:a,x1:b,y0:0,y1:1,fillcolor:'MARKED',opacity:.3,line:{width:0}})))}));
 ways.forEach(f=>{const way=f.calcdata?f._fullData[0]:f.data[0],t=way.customdata,within=[...t.keys()].map(i=>
   at.some(([a,b])=>t[i]>=a&&t[i]<=b)),cut=v=>within.map((w,i)=>w?v[i]:null);
  Plotly.restyle(f,{x:[cut(way.x)],y:[cut(way.y)],z:[cut(way.z)]},[1])})}
document.querySelectorAll('li[data-at]').forEach(li=>li.addEventListener('click',()=>{
 const was=li.classList.contains('chosen');
 document.querySelectorAll('li.chosen').forEach(each=>each.classList.remove('chosen'));
 if(!was)li.classList.add('chosen');
 mark(was?[]:JSON.parse(li.dataset.at))}));
""".replace("MARKED", _MARKED)
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """Curves `(name, x, y)` in one frame; `marks` are values of x with a vertical line."""

    title: str
    x_name: str
    y_name: str
    curves: list[tuple[str, Floats, Floats]]
    marks: tuple[float, ...] = ()
    bounds: tuple[float, ...] = ()
    """Values of y with a horizontal line: the limits."""
    decades: bool = False
    """x is drawn by its logarithm, and must be above 0."""
    over_time: bool = False
    """x is the time of the program, so that its lines can be marked."""

    def figure(self) -> draw.Figure:
        """As plotly draws it."""
        figure = draw.Figure()
        for number, (name, x, y) in enumerate(self.curves):
            thin = slice(None, None, max(1, len(x) // _MOST_POINTS))
            colour = COLOURS[number % len(COLOURS)]
            figure.add_scatter(name=name, x=x[thin], y=y[thin], mode="lines", line={"color": colour, "width": 1.6})
        for mark in self.marks:
            named = {"annotation_text": f"{mark:.4g}"} if self.decades else {}
            figure.add_vline(mark, line={"color": _END, "width": 1}, **named)
        for bound in self.bounds:
            figure.add_hline(bound, line={"color": _LIMIT, "dash": "dash", "width": 1}, annotation_text=f"{bound:.4g}")
        figure.update_layout(
            title=self.title, height=340, margin=_MARGIN, meta="time" if self.over_time else "", showlegend=True
        )
        figure.update_xaxes(title=self.x_name, type="log" if self.decades else "linear")
        figure.update_yaxes(title=self.y_name)
        return figure


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """A path in space that can be turned, and where it is at which time of the program."""

    title: str
    times: Floats
    """`(t,)` [s]"""
    places: Floats
    """`(t, 3)` [mm]"""

    def figure(self) -> draw.Figure:
        """As plotly draws it; the second curve is what is marked of the first."""
        thin = slice(None, None, max(1, len(self.times) // _MOST_POINTS))
        x, y, z = self.places[thin].T
        figure = draw.Figure()
        figure.add_scatter3d(
            x=x.tolist(), y=y.tolist(), z=z.tolist(), customdata=self.times[thin].tolist(), mode="lines", name="TCP",
            line={"color": COLOURS[0], "width": 3},
            hovertemplate="%{x:.1f}, %{y:.1f}, %{z:.1f} mm<br>%{customdata:.3f} s",
        )  # fmt: skip
        figure.add_scatter3d(
            x=[], y=[], z=[], mode="lines", name="marked", line={"color": _MARKED, "width": 8}, hoverinfo="skip"
        )
        figure.add_scatter3d(
            x=[x[0]], y=[y[0]], z=[z[0]], mode="markers", name="begin", marker={"color": "#222", "size": 4}
        )
        axes = {f"{axis}axis_title": f"{axis.upper()} mm" for axis in "xyz"}
        figure.update_layout(
            title=self.title,
            height=560,
            margin=_MARGIN,
            meta="way",
            showlegend=False,
            scene={"aspectmode": "data", **axes},
        )
        return figure


@dataclass(frozen=True, slots=True)
class ProgramLine:
    """A line of a program, and from when to when it moves [s]; a loop has it several times."""

    text: str
    at: tuple[tuple[float, float], ...]


def write_page(file: Path, text: str) -> None:
    """Write a page. Raises `CommandError` where nothing can be written, and for names of other kinds of files."""
    if file.suffix.lower() not in (".html", ".htm"):
        raise CommandError(f"{file}: what is written is a page in HTML", f"name a file like {file.stem}.html")
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise CommandError(
            f"{file} cannot be written: {error.strerror}", "name a file in a folder that exists"
        ) from error


def page(
    title: str,
    summary: Iterable[str],
    figures: Iterable[draw.Figure],
    lists: Mapping[str, list[str]] | None = None,
    program: Iterable[ProgramLine] = (),
) -> str:
    """The HTML text of a page; `lists` by their titles come after the curves, empty ones are left out."""
    drawn = []
    for number, figure in enumerate(figures):
        figure.update_layout(template="plotly_white", hovermode="closest")
        drawn.append(figure.to_html(full_html=False, include_plotlyjs=number == 0, config=_CONFIG))
    listed = "".join(
        f"<h2>{escape(name)}</h2><ul>{_items(lines)}</ul>" for name, lines in (lists or {}).items() if lines
    )
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{_STYLE}</style></head><body><h1>{escape(title)}</h1><ul>{_items(summary)}</ul>"
        f"{_listing(program)}{''.join(drawn)}{listed}<script>{_MARK}</script></body></html>\n"
    )


def _listing(program: Iterable[ProgramLine]) -> str:
    rows = "".join(f"<li{_at(line)}><b>{number}</b>{escape(line.text)}</li>" for number, line in enumerate(program, 1))
    return f"<p>A click on a line marks where it moves.</p><ol class=program>{rows}</ol>" if rows else ""


def _at(line: ProgramLine) -> str:
    return f" data-at='{json.dumps(line.at)}'" if line.at else ""


def _items(lines: Iterable[str]) -> str:
    return "".join(f"<li>{escape(line)}</li>" for line in lines)
