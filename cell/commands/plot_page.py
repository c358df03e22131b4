"""A page with curves over time, drawn as SVG: it opens in any browser and needs nothing else."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cell.commands.errors import CommandError

_WIDTH, _HEIGHT, _MARGIN = 900.0, 240.0, 50.0
_COLOURS = ("#1b6ca8", "#c8553d", "#2e8b57", "#8e5ea2", "#b8860b", "#4d4d4d")
_STYLE = "body{font:14px sans-serif;margin:2em;max-width:960px}svg{border:1px solid #ccc}text{font:11px sans-serif}"
_MOST_POINTS = 2000


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """Curves `(name, x, y)` in one frame; `marks` are values of x with a vertical line, `equal` keeps proportions."""

    title: str
    x_name: str
    y_name: str
    curves: list[tuple[str, NDArray[np.float64], NDArray[np.float64]]]
    marks: tuple[float, ...] = ()
    bounds: tuple[float, ...] = ()
    """Values of y with a horizontal line: the limits."""
    equal: bool = False
    decades: bool = False
    """x is drawn by its logarithm, and must be above 0."""


def write_page(file: Path, text: str) -> None:
    """Write a page. Raises `CommandError` where nothing can be written."""
    try:
        file.write_text(text, encoding="utf-8")
    except OSError as error:
        raise CommandError(
            f"{file} cannot be written: {error.strerror}", "name a file in a folder that exists"
        ) from error


def page(title: str, summary: list[str], charts: list[Chart], lists: Mapping[str, list[str]] | None = None) -> str:
    """The HTML text of a page; `lists` by their titles come behind the charts, empty ones are left out."""
    items = _items(summary)
    listed = "".join(
        f"<h2>{escape(name)}</h2><ul>{_items(lines)}</ul>" for name, lines in (lists or {}).items() if lines
    )
    drawn = "".join(f"<h2>{escape(chart.title)}</h2>{_svg(chart)}" for chart in charts)
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{_STYLE}</style></head><body><h1>{escape(title)}</h1><ul>{items}</ul>{drawn}{listed}</body></html>\n"
    )


def _items(lines: list[str]) -> str:
    return "".join(f"<li>{escape(line)}</li>" for line in lines)


def _svg(chart: Chart) -> str:
    if chart.decades:
        curves = [(name, np.log10(x), y) for name, x, y in chart.curves]
        chart = replace(chart, curves=curves, marks=tuple(float(np.log10(mark)) for mark in chart.marks))
    low, high = _frame(chart)
    height = _HEIGHT
    if chart.equal:
        height = (_WIDTH - 2 * _MARGIN) * float((high[1] - low[1]) / (high[0] - low[0])) + 2 * _MARGIN

    def place(x: NDArray[np.float64], y: NDArray[np.float64]) -> str:
        across = _MARGIN + (x - low[0]) / (high[0] - low[0]) * (_WIDTH - 2 * _MARGIN)
        down = height - _MARGIN - (y - low[1]) / (high[1] - low[1]) * (height - 2 * _MARGIN)
        return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, down, strict=True))

    def line(points: str, style: str) -> str:
        return f'<polyline points="{points}" fill="none" {style}/>'

    parts = [line(place(np.array([mark, mark]), np.array([low[1], high[1]])), 'stroke="#ddd"') for mark in chart.marks]
    parts += [
        line(place(np.array([low[0], high[0]]), np.array([bound, bound])), 'stroke="#c00" stroke-dasharray="6 4"')
        for bound in chart.bounds
    ]
    for bound in chart.bounds:
        _, down = place(low[:1], np.array([bound])).split(",")
        parts.append(f'<text x="{_WIDTH - _MARGIN + 4:.0f}" y="{down}">{bound:.4g}</text>')
    for mark in chart.marks if chart.decades else ():
        across, _ = place(np.array([mark]), low[1:]).split(",")
        parts.append(f'<text x="{across}" y="{height - 30:.0f}">{_label(chart, mark)}</text>')
    for number, (name, x, y) in enumerate(chart.curves):
        colour, thin = _COLOURS[number % len(_COLOURS)], max(1, len(x) // _MOST_POINTS)
        parts.append(line(place(x[::thin], y[::thin]), f'stroke="{colour}" stroke-width="1.5"'))
        parts.append(f'<text x="{_MARGIN + 90 * number}" y="16" fill="{colour}">{escape(name)}</text>')
    parts += [
        f'<text x="{_MARGIN}" y="{height - 30:.0f}">{_label(chart, low[0])}</text>',
        f'<text x="{_WIDTH - _MARGIN - 30}" y="{height - 30:.0f}">{_label(chart, high[0])}</text>',
        f'<text x="{_WIDTH / 2}" y="{height - 12:.0f}">{escape(chart.x_name)}</text>',
        f'<text x="4" y="{height - _MARGIN:.0f}">{low[1]:.3g}</text><text x="4" y="{_MARGIN}">{high[1]:.3g}</text>',
        f'<text x="4" y="32">{escape(chart.y_name)}</text>',
    ]
    return f'<svg width="{_WIDTH:.0f}" height="{height:.0f}" role="img">{"".join(parts)}</svg>'


def _label(chart: Chart, x: float) -> str:
    return f"{10.0**x if chart.decades else x:.4g}"


def _frame(chart: Chart) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper corner `(2,)` around all that is drawn."""
    x = np.concatenate([curve[1] for curve in chart.curves])
    y = np.concatenate([*[curve[2] for curve in chart.curves], np.array(chart.bounds)])
    low, high = np.array([x.min(), y.min()]), np.array([x.max(), y.max()])
    wide = np.maximum(high - low, 1e-6)
    if chart.equal:
        wide = np.maximum(wide, wide.max() / 4.0)
    middle = (low + high) / 2.0
    return middle - 0.52 * wide, middle + 0.52 * wide
