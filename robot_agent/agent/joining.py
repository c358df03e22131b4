"""Which moves of a program are planned as one motion."""

from robot_agent.language import JointStep, MotionStep, SplineStep


def why_apart(step: MotionStep, following: MotionStep) -> str:
    """Why the robot stops between two moves whatever their directions are, for people; empty where it may go on.

    A joint move behind a move of the flange needs all its joints named: where the flange move leaves the others is not
    known before it is planned. A spline takes its direction from a joint move next to it. Where TANG changes, the tool
    may have to turn before the robot goes on.
    """
    if step.pace.round_m == 0.0:
        return "R=0 asks for a stop"
    if isinstance(step, JointStep) or isinstance(following, JointStep):
        return _why_joints_apart(step, following)
    return "" if step.tangential_rad == following.tangential_rad else f"TANG changes before line {following.line}"


def _why_joints_apart(step: MotionStep, following: MotionStep) -> str:
    if any(isinstance(move, JointStep) and not move.synchronised for move in (step, following)):
        return "with SYNC=0 each joint arrives by itself"
    joints = following.joints if isinstance(following, JointStep) and not isinstance(step, JointStep) else None
    if joints is not None and None in joints:
        return f"the MJ in line {following.line} does not name all joints"
    takes_over = any(isinstance(move, SplineStep) and move.tangential_rad is None for move in (step, following))
    return "" if step.pace.round_m is not None or takes_over else "next to a joint move it takes an R"
