"""Moves that are corrected while the robot is on them, and the limits of their corrections."""

import numpy as np

from robot_agent.paths import Line, Sequence
from robot_agent.trajectory import Limits, plan
from robot_agent.trajectory.sources import CorrectionLimits
from tests.unit.six_axis_arm import arm, description

CYCLE_S = 0.004
STEP = 5
NOMINAL = 30
ARM = arm()
LIMITS = Limits.of(description())
START = np.array([0.3, 0.2, 0.3, 0.1, 0.9, 0.2])
CHANGES = CorrectionLimits(0.3, 2.0, 20.0, 0.5, 3.0, 30.0)


def line(offset: tuple[float, float, float], speed_m_s: float | None = None) -> Line:
    target = ARM.forward(START).copy()
    target[:3, 3] += offset
    return Line(target, speed_m_s, 1)


SLOW = plan(ARM, Sequence([line((0.05, 0.15, -0.1), 0.1), line((0, 0, 0), 0.1)]), LIMITS, start=START, cycle_s=CYCLE_S)
FAST = plan(ARM, Sequence([line((0.1, 0.4, -0.2)), line((0, 0, 0))]), LIMITS, start=START, cycle_s=CYCLE_S)
