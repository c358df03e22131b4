"""What a URDF alone says of a robot; everything else is an error with a name."""

from typing import Any, NoReturn

from robot_agent.kinematics.errors import NotInUrdf
from robot_agent.kinematics.urdf.urdf_chain import UrdfChain
from robot_agent.model.description import NOTHING, JointLimits, RobotDescription, UrdfSource


class UrdfLimits(JointLimits):
    """Positions and speeds; acceleration, jerk and the room for ramps raise `NotInUrdf`."""

    def __init__(self, file: str, chain: UrdfChain) -> None:
        object.__setattr__(self, "file", file)
        object.__setattr__(self, "position", chain.position)
        object.__setattr__(self, "velocity", chain.velocity)
        object.__setattr__(self, "acceleration_down", None)

    def __getattr__(self, name: str) -> NoReturn:
        raise _missing(self, name)


class UrdfDescription(RobotDescription):
    """Names, kinds and limits of the joints; home position, path limits and capsules raise `NotInUrdf`."""

    def __init__(self, source: UrdfSource, chain: UrdfChain) -> None:
        values: dict[str, Any] = {
            "file": source.file.name,
            "name": source.file.stem,
            "family": "urdf",
            "geometry": {},
            "joint_names": chain.joint_names,
            "limits": UrdfLimits(source.file.name, chain),
            "linear": chain.linear,
            "coupling": None,
            "tools": {},
            "mounted": NOTHING,
            "urdf": source,
            "motors": {},
            "parts": {},
            "masses": (),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def __getattr__(self, name: str) -> NoReturn:
        raise _missing(self, name)


def _missing(holder: object, name: str) -> Exception:
    """Names of the language itself (`__deepcopy__` and the like) are missing in the ordinary way."""
    if name.startswith("__"):
        return AttributeError(name)
    return NotInUrdf(str(object.__getattribute__(holder, "file")), name)
