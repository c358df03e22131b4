"""From a URDF file to the chain of its joints, by Pinocchio."""

from pathlib import Path

import numpy as np
import pinocchio as pin

from cell.geometry import inverse
from cell.geometry.arrays import Array
from robot_agent.kinematics.chain import Chain, Joint
from robot_agent.kinematics.errors import BadModel
from robot_agent.kinematics.urdf.urdf_chain import UrdfChain
from robot_agent.kinematics.urdf.urdf_text import check_urdf
from robot_agent.model.description import LinkMass, UrdfSource


def read_urdf(source: UrdfSource) -> UrdfChain:
    """The chain of a URDF.

    Raises:
        BadModel: no URDF, a closed loop, no single flange, or a joint that mimics another one or neither turns about
            nor slides along one axis.
    """
    return _chain(*chain_of(source), source.file.name)


def chain_of(source: UrdfSource) -> tuple[pin.Model, list[int], pin.Frame]:
    """The whole model, the joints on the way from its root to the flange, and the flange. Raises as `read_urdf`."""
    model, mimics = _parsed(source.file)
    flange = model.frames[_flange(model, source)]
    joints: list[int] = []
    joint = flange.parentJoint
    while joint:
        joints.insert(0, joint)
        joint = model.parents[joint]
    if not joints:
        raise BadModel(source.file.name, (f"no joint moves the link {flange.name}",))
    names = [model.names[joint] for joint in joints]
    if problems := tuple(_mimicking(name, mimics[name]) for name in names if name in mimics):
        raise BadModel(source.file.name, problems)
    return model, joints, flange


def _parsed(file: Path) -> tuple[pin.Model, dict[str, str]]:
    """The model, and the joints that mimic another one."""
    if not file.is_file():
        raise BadModel(file.name, (f"found no file {file}",))
    mimics = check_urdf(file)
    try:
        return pin.buildModelFromUrdf(str(file)), mimics
    except ValueError as error:
        raise BadModel(file.name, (f"found no valid URDF: {error}",)) from error


def _mimicking(name: str, other: str) -> str:
    return (
        f"joint {name} mimics {other}, allowed joints that move by themselves: make it free, and write the ratio as "
        "coupling into the robot file"
    )


def _flange(model: pin.Model, source: UrdfSource) -> int:
    """Number of the frame of the flange."""
    links = {i: frame.name for i, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY}
    if source.flange is not None:
        named = [i for i, name in links.items() if name == source.flange]
        if not named:
            raise BadModel(
                source.file.name, (f"found no link {source.flange!r}, its links: {', '.join(links.values())}",)
            )
        return named[0]
    parents: set[int] = set()
    for link in links:
        frame = model.frames[link].parentFrame
        while frame not in parents and frame != 0:
            parents.add(frame)
            frame = model.frames[frame].parentFrame
    ends = [link for link in links if link not in parents]
    if len(ends) == 1:
        return ends[0]
    names = ", ".join(links[link] for link in ends)
    raise BadModel(source.file.name, (f"found {len(ends)} links without a child ({names}): name one as the flange",))


def _chain(model: pin.Model, joints: list[int], flange: pin.Frame, file: str) -> UrdfChain:
    data, neutral = model.createData(), pin.neutral(model)
    steps: list[Joint] = []
    frames = [np.eye(4)]
    before = np.eye(4)
    linear, position = [], []
    for joint in joints:
        kind = model.joints[joint]
        if kind.nv != 1:
            raise BadModel(file, (f"joint {model.names[joint]} moves in {kind.nv} directions, allowed 1",))
        motion = pin.computeJointJacobian(model, data, neutral, joint).reshape(6, -1)[:, kind.idx_v]
        slides = bool(np.linalg.norm(motion[:3]) > np.linalg.norm(motion[3:]))
        along_z = _pose(_turn_z_to(motion[:3] if slides else motion[3:]))
        placed = before @ model.jointPlacements[joint].homogeneous @ along_z
        steps.append(Joint(2, tuple(placed[:3, 3].tolist()), slides, placed[:3, :3]))
        before = inverse(along_z)
        frames.append(before)
        linear.append(slides)
        position.append(_range(model, kind))
    frames[-1] = before @ flange.placement.homogeneous
    links = [model.frames[1].name, *(_child(model, joint) for joint in joints[:-1]), flange.name]
    return UrdfChain(
        chain=Chain(tuple(steps), frames[-1]),
        link_frames=np.array(frames),
        joint_names=tuple(model.names[joint] for joint in joints),
        link_names=tuple(links),
        linear=tuple(linear),
        position=np.array(position),
        endless=tuple(model.joints[joint].nq == 2 for joint in joints),
        velocity=np.array([model.velocityLimit[model.joints[joint].idx_v] for joint in joints]),
        masses=_masses(model, joints, flange, file),
    )


def _range(model: pin.Model, kind: pin.JointModel) -> tuple[float, float]:
    if kind.nq == 2:  # Pinocchio keeps cosine and sine of a joint that turns without end
        return -2 * np.pi, 2 * np.pi
    return float(model.lowerPositionLimit[kind.idx_q]), float(model.upperPositionLimit[kind.idx_q])


def _child(model: pin.Model, joint: int) -> str:
    """Name of the link that a joint moves."""
    for frame in model.frames:
        if frame.type == pin.FrameType.BODY and frame.parentJoint == joint:
            return str(frame.name)
    return str(model.names[joint])


def _turn_z_to(axis: Array) -> Array:
    """A rotation `(3, 3)` whose third column is the axis `(3,)`."""
    z = axis / np.linalg.norm(axis)
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def _pose(rotation: Array) -> Array:
    pose = np.eye(4)
    pose[:3, :3] = rotation
    return pose


def _masses(model: pin.Model, joints: list[int], flange: pin.Frame, file: str) -> tuple[LinkMass, ...]:
    """Masses of the links behind `joints`, each in its link's frame; the last link is the flange.

    What is fixed to a link counts with it, and so does what hangs on it beside the way to the flange, with joints at
    zero.
    """
    aside = [joint for joint in range(1, model.njoints) if joint not in joints]
    rigid = pin.buildReducedModel(model, aside, pin.neutral(model))
    masses = []
    for link, joint in enumerate(joints, start=1):
        inertia = rigid.inertias[rigid.getJointId(model.names[joint])]
        if inertia.mass <= 0.0:
            continue
        if link == len(joints):
            inertia = inertia.se3Action(flange.placement.inverse())
        x, y, z = inertia.lever.tolist()
        masses.append(LinkMass(link, float(inertia.mass), (x, y, z), inertia.inertia.copy(), file))
    return tuple(masses)
