"""Inverse dynamics of an open chain with masses: the recursive Newton-Euler algorithm, as Pinocchio has it."""

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from cell.geometry.arrays import Array
from robot_agent.kinematics.chain import Chain, Joint
from robot_agent.model.description import LinkMass

_TURNS = (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ)
_SLIDES = (pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ)


class RigidBody:
    """A chain whose links have masses. Friction, springs and the spin of rotors are not in it."""

    def __init__(self, chain: Chain, masses: Sequence[LinkMass], link_frames: Array, gravity: Array) -> None:
        """
        Args:
            chain: the joints.
            masses: of links 1 (behind the first joint) to `s`.
            link_frames: `(s + 1, 4, 4)` poses of the links in the frames of the chain.
            gravity: `(3,)` [m/s^2] acceleration of free fall in the base.
        """
        self._model = pin.Model()
        self._model.gravity.linear = np.asarray(gravity, dtype=float)
        joints = [0]
        for number, step in enumerate(chain.steps, start=1):
            kind = (_SLIDES if step.linear else _TURNS)[step.axis]()
            joints.append(self._model.addJoint(joints[-1], kind, _placement(step), f"step {number}"))
        for mass in masses:
            body = pin.Inertia(mass.mass_kg, np.array(mass.centre_m), np.asarray(mass.inertia_kg_m2, dtype=float))
            self._model.appendBodyToJoint(joints[mass.link], body, pin.SE3(link_frames[mass.link]))
        self._data = self._model.createData()

    def torques(self, x: Array, xd: Array, xdd: Array) -> Array:
        """Coordinates of the chain, their speeds and accelerations, `(m, s)` each -> what its joints give [Nm or N]."""
        model, data = self._model, self._data
        rows = [pin.rnea(model, data, *row).copy() for row in zip(x, xd, xdd, strict=True)]
        return np.array(rows).reshape(x.shape)


def _placement(step: Joint) -> pin.SE3:
    return pin.SE3(np.eye(3) if step.rotation is None else step.rotation, np.array(step.offset))
