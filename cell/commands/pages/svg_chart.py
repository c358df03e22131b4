"""Curves in a frame with round ticks, drawn as SVG."""

import math
from dataclasses import dataclass
from html import escape

import numpy as np
from numpy.typing import NDArray

_WIDTH, _HEIGHT, _LEFT, _RIGHT, _TOP, _BOTTOM = 900.0, 260.0, 70.0, 40.0, 40.0, 45.0
_TALLEST = 480.0
"""Of a frame that keeps proportions."""
_ROOM = 0.04
"""Beside the curves, where they do not begin at the edge."""
_COLOURS = ("#1b6ca8", "#c8553d", "#2e8b57", "#8e5ea2", "#b8860b", "#4d4d4d")
_MOST_POINTS = 2000
_MOST_TICKS = 8


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

    def x(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values of x as they are drawn."""
        return np.asarray(np.log10(values)) if self.decades else values


@dataclass(frozen=True, slots=True, eq=False)
class _Frame:
    """What is shown, from `low` to `high` `(2,)`, and how large [pixels]."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    width: float
    height: float

    @classmethod
    def around(cls, chart: Chart) -> "_Frame":
        x = np.concatenate([chart.x(curve[1]) for curve in chart.curves])
        y = np.concatenate([*[curve[2] for curve in chart.curves], np.array(chart.bounds)])
        low, high = np.array([x.min(), y.min()]), np.array([x.max(), y.max()])
        wide = np.maximum(high - low, 1e-6)
        width, height = _WIDTH - _LEFT - _RIGHT, _HEIGHT - _TOP - _BOTTOM
        if not chart.equal:
            beside = np.array([0.0, _ROOM * wide[1]])
            return cls(low - beside, low + np.maximum(wide, 1e-6) + beside, width, height)
        wide = (1.0 + 2.0 * _ROOM) * np.maximum(wide, wide.max() / 4.0)
        per_pixel = max(wide[0] / width, wide[1] / _TALLEST)
        wide[0] = per_pixel * width
        middle = (low + high) / 2.0
        return cls(middle - wide / 2.0, middle + wide / 2.0, width, float(wide[1] / per_pixel))

    def across(self, x: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(_LEFT + (x - self.low[0]) / (self.high[0] - self.low[0]) * self.width)

    def down(self, y: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(_TOP + (self.high[1] - y) / (self.high[1] - self.low[1]) * self.height)

    def upright(self, x: float, style: str) -> str:
        at = float(self.across(np.array(x)))
        return f'<polyline points="{at:.1f},{_TOP:.1f} {at:.1f},{_TOP + self.height:.1f}" {style}/>'

    def level(self, y: float, style: str) -> str:
        at = float(self.down(np.array(y)))
        return f'<polyline points="{_LEFT:.1f},{at:.1f} {_LEFT + self.width:.1f},{at:.1f}" {style}/>'


def svg(chart: Chart) -> str:
    """The picture of a chart."""
    frame = _Frame.around(chart)
    parts = [*_ticked(chart, frame), *_marked(chart, frame), *_curves(chart, frame)]
    height = frame.height + _TOP + _BOTTOM
    return f'<svg width="{_WIDTH:.0f}" height="{height:.0f}" role="img">{"".join(parts)}</svg>'


def _ticked(chart: Chart, frame: _Frame) -> list[str]:
    """Both axes."""
    below = _TOP + frame.height
    parts = []
    for value in _ticks(frame.low[0], frame.high[0]):
        parts.append(frame.upright(value, 'stroke="#eee"'))
        at, number = float(frame.across(np.array(value))), 10.0**value if chart.decades else value
        parts.append(f'<text x="{at:.1f}" y="{below + 15:.1f}" text-anchor="middle">{_number(number)}</text>')
    for value in _ticks(frame.low[1], frame.high[1]):
        parts.append(frame.level(value, 'stroke="#eee"'))
        at = float(frame.down(np.array(value)))
        parts.append(f'<text x="{_LEFT - 6:.1f}" y="{at + 4:.1f}" text-anchor="end">{_number(value)}</text>')
    middle = _LEFT + frame.width / 2.0
    parts.append(f'<text x="{middle:.1f}" y="{below + 32:.1f}" text-anchor="middle">{escape(chart.x_name)}</text>')
    parts.append(f'<text x="4" y="{_TOP - 8:.1f}">{escape(chart.y_name)}</text>')
    return parts


def _marked(chart: Chart, frame: _Frame) -> list[str]:
    parts = []
    for mark in chart.marks:
        place = float(chart.x(np.array(mark)))
        parts.append(frame.upright(place, 'stroke="#bbb"'))
        if chart.decades:
            at = float(frame.across(np.array(place)))
            parts.append(f'<text x="{at:.1f}" y="{_TOP - 4:.1f}" text-anchor="middle">{mark:.4g}</text>')
    for bound in chart.bounds:
        parts.append(frame.level(bound, 'stroke="#c00" stroke-dasharray="6 4"'))
        at = float(frame.down(np.array(bound)))
        parts.append(f'<text x="{_LEFT + frame.width + 4:.1f}" y="{at + 4:.1f}">{bound:.4g}</text>')
    return parts


def _curves(chart: Chart, frame: _Frame) -> list[str]:
    parts = []
    for number, (name, x, y) in enumerate(chart.curves):
        colour, thin = _COLOURS[number % len(_COLOURS)], max(1, len(x) // _MOST_POINTS)
        places = zip(frame.across(chart.x(x[::thin])), frame.down(y[::thin]), strict=True)
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in places)
        parts.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
        parts.append(f'<text x="{_LEFT + 90 * number:.1f}" y="16" fill="{colour}">{escape(name)}</text>')
    return parts


def _ticks(low: float, high: float) -> list[float]:
    """Round numbers from `low` to `high`, at most `_MOST_TICKS`."""
    rough = (high - low) / _MOST_TICKS
    decade = 10.0 ** math.floor(math.log10(rough))
    step = next(each * decade for each in (1.0, 2.0, 5.0, 10.0) if each * decade >= rough)
    return [step * k for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _number(value: float) -> str:
    return f"{round(value, 9):.6g}"
