"""Joints inside the agent, axes on the wire: the only place where one becomes the other."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cell.messages import DriveFeedback
from robot_agent.dynamics import AxisTorques
from robot_agent.kinematics import Coupling
from robot_agent.trajectory import Segment


def feedback_in_joints(coupling: Coupling, feedback: DriveFeedback) -> DriveFeedback:
    """What a gateway says about its axes, as positions, speeds and torques of the joints."""
    return replace(
        feedback,
        position=coupling.joints(feedback.position),
        velocity=coupling.joints(feedback.velocity),
        commanded=coupling.joints(feedback.commanded),
        torque=None if feedback.torque is None else coupling.joint_torques(feedback.torque),
    )


def samples_in_axes(
    coupling: Coupling, q: NDArray[np.float64], qd: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Joint positions and speeds `(m, n)` as the axes of a set-point block."""
    return coupling.axes(q), coupling.axes(qd)


def torques_in_axes(torques: AxisTorques | None, segment: Segment) -> NDArray[np.float64] | None:
    """The torque of each sample `(m, n)` [Nm or N]; None where nobody knows it or asks for it.

    Accelerations are second differences of what is commanded, so that blocks say the same of a sample they share; the
    last samples are equal, so the last torque is what carries the robot at rest.
    """
    if torques is None:
        return None
    commanded = np.concatenate([segment.before[-1:], segment.q, segment.q[-1:]])
    return torques.of(segment.q, segment.qd, np.diff(commanded, n=2, axis=0) / segment.cycle_s**2)
