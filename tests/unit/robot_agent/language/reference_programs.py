"""Programs of the reference language, with the arm, the points and the tools that they need."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cell.config.points_file import Point, PosePoint
from cell.geometry import to_xyz_abc
from cell.messages import FramePose
from robot_agent.kinematics import Model, load_model
from robot_agent.model.description import Tool
from tests.unit.repository import ROOT

MODEL = load_model(ROOT / "cell_configs" / "models" / "six_axis.yaml")
HOME = MODEL.forward(MODEL.home)
FRAMES = ("z1", "z2", "z3")
SUB = """HOME F30
MJ P1 F100 //move to starting point
SUB CUT //execute the SUB program
ML P2 F1000
SUB CUT 3 //execute the SUB program 3 times
END
//subroutine defined here
CUT:
  ML P5 T2 Z2
  ML P6 T2 Z2
END
"""


def beside(x_mm: float, y_mm: float, z_mm: float = 0.0) -> PosePoint:
    """A point beside the home pose, in its orientation."""
    pose = HOME.copy()
    pose[:3, 3] += np.array([x_mm, y_mm, z_mm]) / 1000.0
    x, y, z, a, b, c = (float(value) for value in to_xyz_abc(pose))
    return PosePoint((x, y, z), (a, b, c))


POINTS: dict[str, Point] = {
    "P0": beside(0, 0),
    "P1": beside(-100, 0),
    "P2": beside(-100, 240),
    "P3": beside(60, 240),
    "P4": beside(190, 210),
    "P5": beside(200, 100),
    "P6": beside(160, -120),
    "P7": beside(40, -160),
    "P8": beside(0, -60),
}


def with_tools(tools: Sequence[str] = ("t1", "t2")) -> Model:
    """The arm with tools whose TCP is the flange, so that points are where they are."""
    made = {
        name: Tool(name, np.eye(4), mass_kg=1.0, centre_m=(0.0, 0.0, 0.0), inertia_kg_m2=0.01 * np.eye(3), capsules=())
        for name in tools
    }
    return type(MODEL)(replace(MODEL.description, tools=made))


def taught_with(tool: str, *names: str) -> dict[str, Point]:
    """The points, these with a tool."""
    return POINTS | {name: replace(POINTS[name], tool=tool) for name in names}


def placed(name: str, x_mm: float = 0.0, y_mm: float = 0.0, z_mm: float = 0.0) -> FramePose:
    return FramePose(name, 1, None, (x_mm / 1000, y_mm / 1000, z_mm / 1000), (0.0, 0.0, 0.0, 1.0))


STAY = tuple(placed(name) for name in FRAMES)


def at(*names: str) -> NDArray[np.float64]:
    found = [POINTS[name] for name in names]
    return np.array([each.position_m for each in found if isinstance(each, PosePoint)])


TANG = """MJ P0 F100
ML P1 F500
TANG 1{} //activates tangential mode
MS P2
MS P3
MS P4
MS P5
MS P6
MS P7
TANG 0 //deactivates tangential mode
ML P8 F6000
"""
