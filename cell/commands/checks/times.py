"""Times of the cell file that contradict its gateways' cycles or its robots' ramps."""

import math
from collections.abc import Iterator

from cell.commands.checks.readings import Readings
from cell.config.problem import Problem
from robot_agent.model.robot_file import JointEntry, RobotFile

LEAD_CYCLES = 2
"""A block needs this many cycles to reach its gateway before its first tick."""
FEEDBACK_CYCLES = 5
"""An agent sends no new blocks after so many cycles without feedback (architecture, section 6)."""


def check_times(readings: Readings) -> Iterator[Problem]:
    """All contradictions between the cell's times and what its files say."""
    yield from _cycles(readings)
    yield from _estop(readings)


def _cycles(readings: Readings) -> Iterator[Problem]:
    times = readings.cell.times
    for gateway, _, drives in readings.named.usable_drives():
        lead = LEAD_CYCLES * drives.cycle_s
        if times.lead_s < lead:
            allowed = f"{lead:g} or more, {LEAD_CYCLES} cycles of gateway {gateway}"
            yield readings.document.problem(("times", "lead_s"), f"{times.lead_s:g}", allowed)
        feedback = FEEDBACK_CYCLES * drives.cycle_s
        path = ("times", "feedback_lost_s")
        if times.feedback_lost_s < feedback:
            allowed = f"{feedback:g} or more, {FEEDBACK_CYCLES} cycles of gateway {gateway}"
            yield readings.document.problem(path, f"{times.feedback_lost_s:g}", allowed)
        elif times.feedback_lost_s <= drives.overrun_limit_s:
            allowed = f"more than {drives.overrun_limit_s:g}, by which gateway {gateway} may be late (overrun_limit_s)"
            yield readings.document.problem(path, f"{times.feedback_lost_s:g}", allowed)


def _estop(readings: Readings) -> Iterator[Problem]:
    """A gateway must give a robot the time to brake on its path, from a block that has just begun."""
    times = readings.cell.times
    ramps = [
        (_ramp_s(joint, model), robot, name)
        for robot, _, model in readings.named.usable_models()
        for name, joint in model.joints.items()
    ]
    if not ramps:
        return
    ramp_s, robot, joint = max(ramps)
    least = math.ceil(1000 * (times.nominal_s + ramp_s)) / 1000
    if times.estop_delay_s < least:
        ramp = f"the longest ramp, {ramp_s:.3g} of {robot}.{joint}"
        allowed = f"{least:g} or more: nominal_s, {times.nominal_s:g}, and {ramp}"
        yield readings.document.problem(("times", "estop_delay_s"), f"{times.estop_delay_s:g}", allowed)


def _ramp_s(joint: JointEntry, model: RobotFile) -> float:
    """Time from full speed to rest with jerk-limited braking at the ramp limits: v/a + a/j, or 2 sqrt(v/j) below it."""
    acceleration, jerk = model.ramp_factor * min(joint.accelerations), model.ramp_factor * joint.jerk
    if joint.speed < acceleration**2 / jerk:
        return 2 * math.sqrt(joint.speed / jerk)
    return joint.speed / acceleration + acceleration / jerk
