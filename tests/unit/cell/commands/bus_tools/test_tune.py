"""`drive-gateway tune`: margins, step and curves of one axis; and the curves' text."""

from pathlib import Path

import numpy as np
import pytest
from plotly.graph_objects import Figure

from cell.commands.bus_tools.tune import show_tuning
from cell.commands.errors import CommandError
from cell.commands.pages.text_chart import HEIGHT, WIDTH, chart
from drive_gateway.config import load_drives
from drive_gateway.sim.config.load import load_simulation
from drive_gateway.sim.config.simulation import Simulation
from tests.unit.config_world import CONFIGS, DRIVES


def test_margins_step_and_curves_are_shown(capsys: pytest.CaptureFixture[str]) -> None:
    show_tuning(load_drives(CONFIGS / DRIVES, "left_bus"), load_simulation(CONFIGS / DRIVES), "J2")
    shown = capsys.readouterr().out
    assert "speed loop of left.J2" in shown
    assert "gain margin            17.6" in shown
    assert "open loop, phase -180 deg" in shown
    assert "gain, o: open loop, c: closed loop [dB]" in shown


def test_the_page_draws_step_gain_and_phase_with_both_margins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[Figure] = []
    monkeypatch.setattr(
        "cell.commands.bus_tools.tune_page.page", lambda _title, _summary, figures: drawn.extend(figures) or "page"
    )
    page = tmp_path / "tune.html"
    show_tuning(load_drives(CONFIGS / DRIVES, "left_bus"), load_simulation(CONFIGS / DRIVES), "J5", page)
    assert page.read_text() == "page"
    _, gain, phase = drawn
    crossover, margin = (shape.x0 for shape in gain.layout.shapes[:2])
    # Where the crossover's line stands the open loop passes 0 dB; where the other one stands, -180 deg.
    assert np.interp(crossover, gain.data[0].x, gain.data[0].y) == pytest.approx(0.0, abs=0.3)
    assert np.interp(margin, phase.data[0].x, phase.data[0].y) == pytest.approx(-180.0, abs=3.0)
    assert margin > crossover


def test_axis_that_does_not_exist_is_told_with_those_that_do() -> None:
    with pytest.raises(CommandError, match=r"no axis 'J9' on left_bus; its axes are: left.J1"):
        show_tuning(load_drives(CONFIGS / DRIVES, "left_bus"), load_simulation(CONFIGS / DRIVES), "J9")


def test_axis_without_motor_is_told_where_to_add_it() -> None:
    with pytest.raises(CommandError, match=r"nothing says which motor and load left.J1 has on left_bus"):
        show_tuning(load_drives(CONFIGS / DRIVES, "left_bus"), Simulation(), "left.J1")


def test_chart_draws_from_its_lowest_to_its_highest_value() -> None:
    lines = chart("speed", [("*", [0.0, 1.0, 2.0])], "0 s", "1 s", "m/s")
    assert lines[0] == "speed [m/s]"
    assert lines[1].startswith("       2 |")
    assert lines[1].endswith("*")
    assert lines[HEIGHT] == "       0 |" + lines[HEIGHT][10:]
    assert lines[HEIGHT][10] == "*"
    assert len(lines[HEIGHT + 1]) == WIDTH + 10
