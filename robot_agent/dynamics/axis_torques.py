"""The torque that each axis' motor gives behind its gear, for a motion of the joints.

    axes = C^T B^T rnea(B q, B q', B q'') + I_m r^2 a''

with B from the joints to the coordinates of the chain (a palletizer's hand stays level, a spindle has a pitch), C the
coupling (joints = C axes), I_m the rotor's inertia and r shaft angle per axis. Both transposes say that the work is
the same on either side. Not in it: friction, springs that bear weight, the bars of a palletizer's parallelograms, and
what a spinning rotor does to the link that carries it.
"""

from typing import TYPE_CHECKING

import numpy as np

from cell.geometry import transform_points
from cell.geometry.arrays import Array
from robot_agent.kinematics.model import Model
from robot_agent.kinematics.serial import SerialModel
from robot_agent.model.description import LinkMass, RobotDescription

if TYPE_CHECKING:
    from robot_agent.dynamics.rigid_body import RigidBody

GRAVITY_M_S2 = 9.80665
"""Standard acceleration of free fall."""


class AxisTorques:
    """See the module. A robot without masses has only its rotors, and one without motors no rotors."""

    def __init__(self, model: Model, gravity: Array) -> None:
        """`gravity`: `(3,)` [m/s^2] acceleration of free fall in the robot's base."""
        self._model = model
        self._body = _body(model, gravity)
        motors = model.description.motors
        self._rotors = np.array(
            [
                motors[name].inertia_kg_m2 * motors[name].ratio ** 2 if name in motors else 0.0
                for name in model.joint_names
            ]
        )
        """[kg m^2 or kg] at each axis."""

    @property
    def knows_links(self) -> bool:
        """The robot has masses."""
        return self._body is not None

    def of(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Joints, their speeds and accelerations, `(m, n)` each -> torques of the axes `(m, n)` [Nm, or N of a slide].

        Raises:
            BadInput: another number of joints, or a value that is not finite.
        """
        check, coupling = self._model.check_joints, self._model.coupling
        q, qd, qdd = check(q), check(qd, "joint speeds"), check(qdd, "joint accelerations")
        return np.asarray(coupling.axes(qdd) * self._rotors + self._links(q, qd, qdd))

    def of_links(self, axes: Array, speeds: Array, accelerations: Array) -> Array:
        """Axes, their speeds and accelerations, `(m, n)` each -> the part of it that moves links and tool `(m, n)`."""
        joints = self._model.coupling.joints
        return self._links(joints(axes), joints(speeds), joints(accelerations))

    def _links(self, q: Array, qd: Array, qdd: Array) -> Array:
        if self._body is None:
            return np.zeros_like(q)
        body, mixing = self._body
        joints = body.torques(q @ mixing.T, qd @ mixing.T, qdd @ mixing.T) @ mixing
        return self._model.coupling.axis_torques(joints)

    def standing(self, q: Array) -> Array:
        """Joints `(m, n)` -> what carries the robot at rest there, `(m, n)` [Nm, or N of a slide]."""
        still = np.zeros_like(q)
        return self.of(q, still, still)


def axis_torques(model: Model, pose_world_base: Array) -> AxisTorques | None:
    """The torques of a robot whose base is at `pose_world_base` `(4, 4)`; None without both masses and motors."""
    if _masses(model) or model.description.motors:
        return AxisTorques(model, pose_world_base[:3, :3].T @ [0.0, 0.0, -GRAVITY_M_S2])
    return None


def _body(model: Model, gravity: Array) -> "tuple[RigidBody, Array] | None":
    """The chain with its masses, and from joints to its coordinates `(s, n)`; None without masses."""
    masses = _masses(model)
    if not masses or not isinstance(model, SerialModel):
        return None
    from robot_agent.dynamics.rigid_body import RigidBody  # Pinocchio takes 0.4 s, which only these robots wait for

    return RigidBody(model.chain, masses, model.link_frames, gravity), model.mixing


def _masses(model: Model) -> tuple[LinkMass, ...]:
    """Of links, tool and part; these alone are not the robot's weight, so without links there is none.

    Which of several tools or parts it carries nobody knows, and none of them counts. The arms of a
    delta are closed chains: nothing but its rotors is known.
    """
    if not isinstance(model, SerialModel) or not model.masses:
        return ()
    tool, flange = model.description.tool, len(model.link_names) - 1
    carried = [] if tool is None else [LinkMass(flange, tool.mass_kg, tool.centre_m, tool.inertia_kg_m2, tool.name)]
    if len(model.description.mounted.parts) == 1:
        carried.append(_held_mass(model.description, flange))
    return (*model.masses, *(each for each in carried if each.mass_kg > 0.0))


def _held_mass(description: RobotDescription, flange: int) -> LinkMass:
    """The part that is held, in the frame of the flange."""
    part, pose_flange_tcp = description.parts[description.mounted.parts[0]], description.pose_flange_tcp
    turn = pose_flange_tcp[:3, :3]
    x, y, z = transform_points(pose_flange_tcp, np.array([part.centre_m]))[0].tolist()
    return LinkMass(flange, part.mass_kg, (x, y, z), turn @ part.inertia_kg_m2 @ turn.T, part.name)
