"""From one step of a program to a planned motion with its swept body. Runs in a worker; pure, so tests call it too."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cell.core import Effect
from cell.messages import ZoneGeometry
from robot_agent.agent.targets import joint_target, line_target
from robot_agent.kinematics import KinematicsError, Model
from robot_agent.language import JointStep, LineStep
from robot_agent.paths import JointMove, Line, Sequence
from robot_agent.trajectory import Limits, Motion, PlanError, plan
from robot_agent.workspace import Crossing, Sweep, crossings, sweep

ZONE_MARGIN_M = 0.03
"""A robot stops this far in front of a zone it may not enter: more than the growth of a published body."""


@dataclass(frozen=True, slots=True, eq=False)
class PlanRequest:
    """Plan one step from rest at `start` `(n,)` to rest."""

    id: int
    step: JointStep | LineStep
    start: NDArray[np.float64]
    zones: tuple[ZoneGeometry, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Plan(Effect):
    """The shell's worker plans; `Planned` or `PlanFailed` with the same id comes back."""

    request: PlanRequest


@dataclass(frozen=True, slots=True, eq=False)
class Planned:
    """A motion, the body it sweeps in world, and where on it the zones of the request are entered and left."""

    id: int
    line: int
    motion: Motion
    sweep: Sweep
    crossings: tuple[Crossing, ...]
    zone_versions: dict[str, int]


@dataclass(frozen=True, slots=True)
class PlanFailed:
    """Why a step cannot be planned, for people."""

    id: int
    line: int
    text: str


class Planner:
    """Plans the steps of one robot. `pose_world_base` is `(4, 4)`, `cycle_s` the gateway's cycle."""

    def __init__(self, model: Model, limits: Limits, pose_world_base: NDArray[np.float64], cycle_s: float) -> None:
        self.model = model
        self.limits = limits
        self.pose_world_base = pose_world_base
        self.cycle_s = cycle_s

    def plan(self, request: PlanRequest) -> Planned | PlanFailed:
        """Plan a step; every failure is a `PlanFailed` that says where and why."""
        try:
            motion = self._motion(request)
            return self._with_body(request.id, request.step.line, motion, request.zones)
        except PlanError as error:
            return PlanFailed(request.id, request.step.line, str(error))
        except KinematicsError as error:
            return PlanFailed(request.id, request.step.line, f"line {request.step.line}: {error}")

    def standstill(self, q: NDArray[np.float64], zones: tuple[ZoneGeometry, ...]) -> Planned:
        """The motion of a robot that stands at `q` `(n,)`."""
        motion = plan(self.model, Sequence([JointMove(q, 1.0, 0)]), self.limits, start=q, cycle_s=self.cycle_s)
        return self._with_body(0, 0, motion, zones)

    def _motion(self, request: PlanRequest) -> Motion:
        block: JointMove | Line
        step = request.step
        if isinstance(step, JointStep):
            block = JointMove(joint_target(step, request.start, self.model.home), step.speed, step.line)
        else:
            block = Line(line_target(step, self.model.forward(request.start)), step.speed_m_s, step.line)
        return plan(self.model, Sequence([block]), self.limits, start=request.start, cycle_s=self.cycle_s)

    def _with_body(self, id: int, line: int, motion: Motion, zones: tuple[ZoneGeometry, ...]) -> Planned:
        taus = motion.grid
        body = sweep(self.model, self.pose_world_base, motion.q(taus))
        crossed = tuple(c for zone in zones for c in crossings(body, taus, zone, ZONE_MARGIN_M))
        return Planned(id, line, motion, body, crossed, {zone.zone: zone.version for zone in zones})
