"""Joints inside the agent, axes on the wire: the only place where one becomes the other."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cell.messages import DriveFeedback
from robot_agent.kinematics import Coupling


def feedback_in_joints(coupling: Coupling, feedback: DriveFeedback) -> DriveFeedback:
    """What a gateway says about its axes, as positions and speeds of the joints."""
    return replace(
        feedback,
        position=coupling.joints(feedback.position),
        velocity=coupling.joints(feedback.velocity),
        commanded=coupling.joints(feedback.commanded),
    )


def samples_in_axes(
    coupling: Coupling, q: NDArray[np.float64], qd: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Joint positions and speeds `(m, n)` as the axes of a set-point block."""
    return coupling.axes(q), coupling.axes(qd)
