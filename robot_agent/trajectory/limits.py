"""The limits a motion keeps: joints and path, in the sets `plan` and `ramp`."""

import math
from dataclasses import asdict, dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from robot_agent.model.description import DEFAULT_SHAPING, PathSpeeds, RobotDescription, Shaping


@dataclass(frozen=True, slots=True, eq=False)
class Limits:
    """Joint limits `(n,)` [rad or m, s] and path limits that planning uses, and the larger ones of braking ramps.

    Where a plan already brakes at its limit nothing is left for braking harder along the same path, so a ramp may use
    `ramp_factor` times the planned acceleration and jerk (`docs/architecture.md`, section 5.2).
    """

    velocity: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    jerk: NDArray[np.float64]
    path: PathSpeeds
    ramp_factor: float
    shaping: Shaping = DEFAULT_SHAPING
    """How motions within the limits are shaped."""
    linear: tuple[bool, ...] = ()
    """Whether each joint slides; empty when all joints turn."""
    acceleration_down: NDArray[np.float64] | None = None
    """`(n,)` the largest towards lower values of each joint, where it is not the one towards higher values."""

    def __post_init__(self) -> None:
        """Raise ValueError for limits that are not finite and above 0, and for ramps softer than the plan."""
        joints = {name: getattr(self, name) for name in ("velocity", "acceleration", "jerk", "acceleration_down")}
        for name, found in {**joints, **asdict(self.path)}.items():
            if found is not None and not (np.isfinite(found) & (np.asarray(found) > 0.0)).all():
                raise ValueError(f"limits: {name} {found} found, allowed finite values above 0")
        if not 1.0 <= self.ramp_factor < math.inf:
            raise ValueError(f"limits: ramp_factor {self.ramp_factor} found, allowed from 1")

    @classmethod
    def of(cls, description: RobotDescription) -> Self:
        """The limits of a robot file."""
        joints = description.limits
        path, factor = description.path, joints.ramp_factor
        shaping, linear = description.shaping, description.linear
        down = joints.acceleration_down
        return cls(joints.velocity, joints.acceleration, joints.jerk, path, factor, shaping, linear, down)

    @property
    def turning(self) -> NDArray[np.bool_]:
        """`(n,)` which joints turn."""
        return ~np.array(self.linear) if self.linear else np.ones(len(self.velocity), dtype=np.bool_)

    @property
    def acceleration_bounds(self) -> NDArray[np.float64]:
        """`(2, n)` lower and upper bound of each joint's acceleration."""
        down = self.acceleration if self.acceleration_down is None else self.acceleration_down
        return np.stack([-down, self.acceleration])

    @property
    def both_ways(self) -> NDArray[np.float64]:
        """`(n,)` the acceleration that each joint may have in either direction."""
        return np.asarray(np.abs(self.acceleration_bounds).min(axis=0))

    @property
    def ramp_acceleration_bounds(self) -> NDArray[np.float64]:
        """`(2, n)` lower and upper bound of what the samples on the wire may use, ramps included."""
        return self.ramp_factor * self.acceleration_bounds

    @property
    def ramp_jerk(self) -> NDArray[np.float64]:
        """`(n,)` what the samples on the wire may use, ramps included."""
        return self.ramp_factor * self.jerk
