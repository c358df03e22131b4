"""`drive-gateway tune`: margins, step and curves of one axis; and the curves' text."""

import re
from pathlib import Path

import numpy as np
import pytest

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


def test_the_page_draws_step_gain_and_phase_with_both_margins(tmp_path: Path) -> None:
    page = tmp_path / "tune.html"
    show_tuning(load_drives(CONFIGS / DRIVES, "left_bus"), load_simulation(CONFIGS / DRIVES), "J5", page)
    drawn = page.read_text()
    assert drawn.count("<svg") == 3
    gain = drawn.split("<svg")[2]
    marks, bounds, lines = (
        [np.array(list(map(float, points.replace(",", " ").split()))) for points in re.findall(pattern, gain)]
        for pattern in (f'points="([^"]+)" {style}' for style in ('stroke="#bbb"', 'stroke="#c00"', "fill"))
    )
    (crossover, margin), (zero,), opened = marks, bounds, lines[0].reshape(-1, 2)
    # Where the crossover's line stands the open loop passes 0 dB.
    assert np.interp(crossover[0], opened[:, 0], opened[:, 1]) == pytest.approx(zero[1], abs=1.5)
    assert margin[0] > crossover[0]


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
