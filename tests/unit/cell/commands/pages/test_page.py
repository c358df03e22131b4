"""The page of curves: everything comes with it, nothing leaves it."""

import re

import numpy as np
import pytest

from cell.commands.pages.page import Chart, ProgramLine, Way, page

T = np.linspace(0.0, 10.0, 101)


def text() -> str:
    charts = [
        Way("A way", T, np.stack([T, T**2, np.zeros_like(T)], axis=1)),
        Chart("A curve", "s", "mm", [("x<1>", T, np.sin(T))], (5.0,), (1.0, -1.0), over_time=True),
    ]
    lines = [ProgramLine("ML X=1", ((0.0, 2.5), (5.0, 6.0))), ProgramLine("WAIT <1>", ())]
    return page("title & more", ["a < b"], [chart.figure() for chart in charts], {"none": [], "one": ["<i>"]}, lines)


def test_it_opens_without_a_network() -> None:
    whole = text()
    assert re.findall(r"<(?:script|link|img)[^>]*\s(?:src|href)=", whole) == []
    assert whole.count("plotly.js v") == 1


def test_no_button_sends_what_is_shown_anywhere() -> None:
    own = [config for config in re.findall(r"\{[^{}]*\"displaylogo\"[^{}]*\}", text()) if "sendDataToCloud" in config]
    assert len(own) == 2
    assert all('"showSendToCloud": false' in config for config in own)


def test_what_comes_from_files_is_no_markup() -> None:
    whole = text()
    assert "<h1>title &amp; more</h1>" in whole
    assert "a &lt; b" in whole
    assert "<li>&lt;i&gt;</li>" in whole
    assert "<h2>none</h2>" not in whole
    assert "<li data-at='[[0.0, 2.5], [5.0, 6.0]]'><b>1</b>ML X=1</li><li><b>2</b>WAIT &lt;1&gt;</li>" in whole


def test_limits_and_ends_are_drawn_at_their_values() -> None:
    figure = Chart("c", "s", "%", [("J1", T, T)], (2.0, 4.0), (100.0,)).figure()
    upright = [shape.x0 for shape in figure.layout.shapes if shape.x0 == shape.x1]
    level = [shape.y0 for shape in figure.layout.shapes if shape.y0 == shape.y1]
    assert (upright, level) == ([2.0, 4.0], [100.0])
    assert [each.text for each in figure.layout.annotations] == ["100"]


@pytest.mark.parametrize("count", [2, 3999, 4000, 100_000])
def test_a_long_curve_is_thinned_and_keeps_its_first_point(count: int) -> None:
    t = np.linspace(0.0, 1.0, count)
    (curve,) = Chart("c", "s", "%", [("J1", t, t)]).figure().data
    assert min(count, 4000) <= len(curve.x) < 8000
    assert curve.x[0] == 0.0
