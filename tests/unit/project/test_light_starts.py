"""What a process does without until it is needed: half of the start of an agent is Pinocchio."""

import subprocess
import sys

from tests.unit.repository import ROOT

_AGENT = """
import sys
from pathlib import Path
from cell.config import load_cell
import robot_agent.agent.shell
from robot_agent.agent.planning.planner import Planner
from robot_agent.workspace import PlacedRobot
placed = PlacedRobot.of(load_cell(Path("cell_configs/two_arms/cell.yaml")).robots["left"])
Planner(placed, 0.004)
print("pinocchio" in sys.modules)
{more}
print("pinocchio" in sys.modules)
"""
_TORQUES = "from robot_agent.dynamics import axis_torques; axis_torques(placed.model, placed.pose_world_base)"


def test_an_agent_whose_drives_ask_for_no_torques_does_without_pinocchio() -> None:
    command = [sys.executable, "-c", _AGENT.format(more=_TORQUES)]
    said = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=True).stdout
    assert said.split() == ["False", "True"]
