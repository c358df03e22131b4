"""The next block of a path that is corrected while it runs."""

import time

import numpy as np

from bench.timing import Row
from robot_agent.kinematics import Model
from robot_agent.paths import JointMove, Sequence
from robot_agent.trajectory import Governor, Limits, plan
from robot_agent.trajectory.sources import CorrectedSource, CorrectionLimits, Target

CYCLE_S = 0.004
NOMINAL = 30
STEP = 5
BELT_M_S = 0.05
BLOCKS = 60
LIMITS = CorrectionLimits(0.2, 2.0, 20.0, 0.5, 3.0, 30.0)


def corrections(model: Model, iterating: Model) -> list[Row]:
    """Over a second on a moving belt, of a closed form and of an inverse that iterates."""
    return [
        Row(f"block of a corrected path, {what}", each, each / (STEP * CYCLE_S), "of the 20 ms it has")
        for what, each in (("closed form", _median_s(model)), ("iterating", _median_s(iterating)))
    ]


def _median_s(model: Model) -> float:
    limits = Limits.of(model.description)
    start = model.home
    move = Sequence([JointMove(start + 0.1 * limits.velocity / limits.velocity.max(), 0.2, 1)])
    motion = plan(model, move, limits, start=start, cycle_s=CYCLE_S)
    governor = Governor(motion, limits, CYCLE_S, NOMINAL * CYCLE_S)
    source = CorrectedSource(model, limits, governor, governor.rest(0.0), LIMITS)
    speed = np.array([0.0, BELT_M_S, 0.0, 0.0, 0.0, 0.0])
    times = []
    for block in range(BLOCKS):
        source.target = Target(block * STEP * CYCLE_S * speed, speed)
        begun = time.perf_counter()
        source.samples(NOMINAL)
        source.resume(STEP)
        times.append(time.perf_counter() - begun)
    return float(np.median(times))
