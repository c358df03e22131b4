"""`cell model` as its users see it."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from cell.commands.cell_command import app
from cell.commands.errors import CommandError
from tests.unit.config_world import CONFIGS, ROBOT, Copy

RUNNER = CliRunner(env={"COLUMNS": "140"})
MODELS = CONFIGS / "models"


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        (
            "six_axis.yaml",
            (
                "BOOK6, family six_axis",
                "reach",
                "FRONT/UP/POSITIVE",
                "all solutions",
                "-35",
                "X 880.",
                "400 kg",
                "estimate",
            ),
        ),
        ("scara.yaml", ("linear mm", "-150", "RIGHT, LEFT", "1, 20 mm", "2000 mm/s", "298 N")),
        (
            "palletizer.yaml",
            (
                "-1 J2",
                "base, 1, 2, 3, hand, flange",
                "cups: TCP",
                "18 kg",
                "84-300",
                "48.5/207",
                "156 deg/s",
                "J1, J2, J3: Frigeni",
            ),
        ),
        ("painter.yaml", ("numeric", "axes")),
        ("painter.urdf", ("axis_1", "-", "numeric")),
    ],
)
def test_it_prints_axes_limits_reach_home_and_branches(name: str, expected: tuple[str, ...]) -> None:
    result = RUNNER.invoke(app, ["model", str(MODELS / name)])
    assert result.exit_code == 0
    for text in expected:
        assert text in result.output


def test_another_acceleration_towards_lower_values_is_shown_with_its_joint(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(ROBOT, "acceleration: 280, jerk", "acceleration: 280, acceleration_down: 70, jerk")
    result = RUNNER.invoke(app, ["model", str(copy.robot)])
    assert result.output.count("down") == 1
    assert "280, down 70" in result.output


def test_a_file_that_is_no_robot_is_refused_with_the_next_step(tmp_path: Path) -> None:
    (tmp_path / "bad.urdf").write_text("<robot")
    result = RUNNER.invoke(app, ["model", str(tmp_path / "bad.urdf")])
    assert isinstance(result.exception, CommandError)
    assert "no valid URDF" in result.exception.what
    assert "cell model" in result.exception.next_step
