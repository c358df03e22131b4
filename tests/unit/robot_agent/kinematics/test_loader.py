from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cell.config import ConfigError
from robot_agent.kinematics import BadModel, load_model, model_of
from tests.unit.six_axis_arm import VECTORS, description

JOINT = "{position: [-180, 180], speed: 100, acceleration: 300, jerk: 3000}"
ROBOT = f"""\
name: example
family: six_axis
units: {{length: mm, angle: deg}}
geometry: {{{", ".join(f"{name}: {value}" for name, value in VECTORS["model"].items())}}}
joints:
{"".join(f"  J{i}: {JOINT}" + chr(10) for i in range(1, 7))}ramp_factor: 1.5
path:
  speed: 500
  acceleration: 2000
  jerk: 20000
  angular_speed: 90
  angular_acceleration: 360
  angular_jerk: 3600
home: {{J1: 0, J2: -20, J3: 20, J4: 0, J5: 60, J6: 0}}
capsules:
  - {{link: 0, start: [0, 0, 0], end: [0, 0, 400], radius: 200}}
  - {{link: 6, start: [0, 0, 0], end: [100, 0, 0], radius: 60}}
"""


def test_a_robot_file_becomes_its_kinematics(tmp_path: Path) -> None:
    file = tmp_path / "arm.yaml"
    file.write_text(ROBOT)
    model = load_model(file)
    assert (model.n, model.joint_names) == (6, ("J1", "J2", "J3", "J4", "J5", "J6"))
    np.testing.assert_allclose(model.home, np.radians([0, -20, 20, 0, 60, 0]))
    np.testing.assert_allclose(model.forward(np.zeros(6))[:3, 3], [1.755, 0, 2.66])
    assert model.capsules(model.home).shape == (2, 2, 3)
    assert model.limits.position.shape == (6, 2)


def test_a_file_with_problems_is_refused_with_its_lines(tmp_path: Path) -> None:
    file = tmp_path / "arm.yaml"
    file.write_text(ROBOT.replace("a3z: 1100", "a3z: 0"))
    with pytest.raises(ConfigError, match=r"arm\.yaml:4"):
        load_model(file)


def test_a_robot_without_a_body_is_refused() -> None:
    with pytest.raises(BadModel, match="no capsules"):
        model_of(replace(description(), capsules=()))
