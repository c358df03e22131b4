"""How the links of a URDF look: meshes and simple solids, each held by a link of the chain.

Format: http://wiki.ros.org/urdf/XML/link, element `visual`. Nothing is solved or kept apart by it: bodies are capsules.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from cell.config.settings import BoxShape, CylinderShape, MeshShape, Shape, SphereShape
from cell.geometry.arrays import Array
from robot_agent.kinematics.errors import BadModel
from robot_agent.kinematics.urdf.urdf_reader import chain_of
from robot_agent.model.description import UrdfSource

_PACKAGE, _FILE = "package://", "file://"
_SHAPES = "mesh, box, cylinder or sphere"


@dataclass(frozen=True, slots=True, eq=False)
class Visual:
    """One solid or mesh."""

    link: int
    """Which of `Model.links` holds it."""
    pose_link_visual: Array
    """`(4, 4)`"""
    shape: Shape
    scale: tuple[float, float, float]
    """Of a mesh along its own axes; 1 for everything else."""


def urdf_visuals(source: UrdfSource) -> tuple[Visual, ...]:
    """What the links of a URDF look like, in the order of the file; what hangs on them beside the way to the flange
    stands as it does with its joints at zero.

    Raises:
        BadModel: no URDF, or a `visual` that is none.
    """
    model, joints, flange = chain_of(source)
    aside = [joint for joint in range(1, model.njoints) if joint not in joints]
    rigid = pin.buildReducedModel(model, aside, pin.neutral(model))
    held_by = {0: 0} | {rigid.getJointId(model.names[joint]): i for i, joint in enumerate(joints, start=1)}
    visuals: list[Visual] = []
    problems: list[str] = []
    for link in ElementTree.fromstring(source.file.read_bytes()).findall("link"):
        name = link.get("name", "")
        frame = rigid.frames[rigid.getFrameId(name, pin.FrameType.BODY)]
        held = held_by[frame.parentJoint]
        # The last link of the chain is the flange, not the frame of the joint in front of it.
        before = flange.placement.inverse() if held == len(joints) else pin.SE3.Identity()
        for visual in link.findall("visual"):
            try:
                pose = (before * frame.placement).homogeneous @ _origin(visual)
                visuals += [Visual(held, pose, shape, scale) for shape, scale in _shapes(visual, source.file)]
            except ValueError as error:
                problems.append(f"link {name} has a visual that is none: {error}")
    if problems:
        raise BadModel(source.file.name, tuple(problems))
    return tuple(visuals)


def _shapes(visual: ElementTree.Element, urdf: Path) -> Iterator[tuple[Shape, tuple[float, float, float]]]:
    """Raises `ValueError`."""
    found = visual.find("geometry/*")
    kind = "nothing" if found is None else found.tag
    whole = (1.0, 1.0, 1.0)
    match kind:
        case "mesh":
            file = _attribute(found, "filename")
            yield MeshShape(_located(file, urdf), 1.0), _three(found, "scale", "1 1 1")
        case "box":
            yield BoxShape(_three(found, "size")), whole
        case "cylinder":
            yield CylinderShape(_number(found, "radius"), _number(found, "length")), whole
        case "sphere":
            yield SphereShape(_number(found, "radius")), whole
        case _:
            raise ValueError(f"geometry {kind}, allowed {_SHAPES}")


def _origin(visual: ElementTree.Element) -> Array:
    """`(4, 4)`: `rpy` turns about fixed axes X, Y, Z, in this order."""
    origin, pose = visual.find("origin"), np.eye(4)
    if origin is not None:
        pose[:3, :3] = pin.rpy.rpyToMatrix(*_three(origin, "rpy", "0 0 0"))
        pose[:3, 3] = _three(origin, "xyz", "0 0 0")
    return pose


def _located(name: str, urdf: Path) -> Path:
    """A path beside the URDF, a `file://`, or one in a package, whose folder is around the URDF or beside those."""
    if name.startswith(_FILE):
        return Path(name.removeprefix(_FILE))
    if not name.startswith(_PACKAGE):
        return urdf.parent / name
    package, _, rest = name.removeprefix(_PACKAGE).partition("/")
    around = urdf.resolve().parents
    places = [*(folder / rest for folder in around if folder.name == package), *(up / package / rest for up in around)]
    return next((place for place in places if place.is_file()), places[0])


def _attribute(element: ElementTree.Element | None, name: str, default: str = "") -> str:
    text = "" if element is None else element.get(name, default)
    if not text:
        raise ValueError(f"no {name}")
    return text


def _number(element: ElementTree.Element | None, name: str) -> float:
    text = _attribute(element, name)
    value = float(text)
    if not 0.0 < value < np.inf:
        raise ValueError(f"{name} {text!r}, allowed a number above 0")
    return value


def _three(element: ElementTree.Element | None, name: str, default: str = "") -> tuple[float, float, float]:
    text = _attribute(element, name, default)
    values = [float(word) for word in text.split()]
    if len(values) != 3 or not np.isfinite(values).all():
        raise ValueError(f"{name} {text!r}, allowed three numbers")
    return values[0], values[1], values[2]
