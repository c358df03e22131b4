"""What must hold at every step of a simulated cell, whatever the network and the machines do.

Samples are kept and judged many at once, at the latest when the clock pauses.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cell.geometry import transform_points
from cell.messages import DriveFeedback
from tests.sim.planned_paths import PlannedPaths
from tests.sim.volume import Volume
from tests.sim.world import World

_ON_PATH_RAD = 2e-6
_LIMIT_TOLERANCE = 1.01
_BODY_EVERY_TICKS = 2
_MOST_KEPT = 64
"""Samples of one robot, and bodies."""
_BEFORE = 4
"""Judged samples that are kept: a jerk takes four."""


class Broken(AssertionError):
    """An invariant does not hold."""


@dataclass(slots=True)
class _Samples:
    """What one robot was commanded since it was enabled, in axes, after the last samples that are judged."""

    at: list[float] = field(default_factory=list)
    axes: list[NDArray[np.float64]] = field(default_factory=list)
    judged: int = 0
    plans: int = 0
    """So many had been made when the samples were taken."""

    def forget(self, kept: int) -> None:
        """All are judged; keep the newest."""
        self.at, self.axes = self.at[len(self.at) - kept :], self.axes[len(self.axes) - kept :]
        self.judged = len(self.at)


class Invariants:
    """Watches the drives: what they are commanded, and where they really are."""

    def __init__(self, world: World, planned: bool = True) -> None:
        """`planned`: robots move on planned paths only; false where they are jogged."""
        self._world = world
        self._planned = planned
        self._inside: dict[str, dict[str, bool]] = {}
        self._samples = {robot: _Samples() for robot in world.cell.robots}
        self._bodies: list[tuple[float, str, NDArray[np.float64]]] = []
        self._paths = PlannedPaths()
        self.samples = 0
        self.time_inside_s = dict.fromkeys(world.cell.robots, 0.0)
        self._boxes = {zone.name: Volume.at(zone) for zone in world.cell.zones.values()}
        world.on_feedback.append(self.look)
        world.clock.on_pause.append(self._judge_all)

    def look(self, feedback: DriveFeedback) -> None:
        """One cycle of one robot."""
        robot, now = feedback.robot, self._world.clock.now
        if feedback.tick % _BODY_EVERY_TICKS == 0:
            self._bodies.append((now, robot, self._measured(robot)))
            if len(self._bodies) >= _MOST_KEPT:
                self._one_body_in_a_zone()
        samples, plans = self._samples[robot], len(self._world.seen.planned[robot])
        if not feedback.enabled or plans != samples.plans or len(samples.at) - samples.judged >= _MOST_KEPT:
            self._judge(robot)
            samples.plans = plans
        if not feedback.enabled:
            samples.forget(0)
            return
        samples.at.append(now)
        samples.axes.append(feedback.commanded)
        self.samples += 1

    def _measured(self, robot: str) -> NDArray[np.float64]:
        """The axes by the simulated drives themselves, not by what anyone reports of them."""
        gateway = f"gateway/{self._world.cell.robots[robot].gateway}"
        axes = self._world.bundle.gateways[gateway.partition("/")[2]].robots[robot].axes
        nodes = self._world.buses[gateway].nodes
        return np.array([nodes[a.node_id].drives[a.number - 1].position / a.counts_per_unit + a.offset for a in axes])

    def _judge_all(self) -> None:
        self._one_body_in_a_zone()
        for robot in self._samples:
            self._judge(robot)

    def _one_body_in_a_zone(self) -> None:
        """All bodies that were kept, one after the other."""
        bodies, self._bodies = self._bodies, []
        touching: list[dict[str, bool]] = [{} for _ in bodies]
        for robot in self._samples:
            mine = [i for i, (_, whose, _) in enumerate(bodies) if whose == robot]
            if mine:
                for zone, flags in self._touches(robot, np.array([bodies[i][2] for i in mine])).items():
                    for i, flag in zip(mine, flags, strict=True):
                        touching[i][zone] = bool(flag)
        for (at, robot, _), zones in zip(bodies, touching, strict=True):
            for zone, inside_now in zones.items():
                inside = self._inside.setdefault(zone, {})
                inside[robot] = inside_now
                self.time_inside_s[robot] += inside_now * _BODY_EVERY_TICKS * self._world.cycle_s(robot)
                if sum(inside.values()) > 1:
                    raise Broken(f"at {at:.3f} s {sorted(inside)} are in zone {zone} together")

    def _touches(self, robot: str, axes: NDArray[np.float64]) -> dict[str, NDArray[np.bool_]]:
        """By zone: whether the robot's body, with axes `(m, n)`, touches it `(m,)`."""
        planner, model = self._world.planners[robot], self._world.models[robot]
        q = model.coupling.joints(axes)
        points = transform_points(planner.pose_world_base, model.capsules(q))
        tcp = (planner.pose_world_base @ model.forward(q))[..., :3, 3]
        return {zone: volume.touched(points, model.capsule_radii, tcp) for zone, volume in self._boxes.items()}

    def _judge(self, robot: str) -> None:
        """All samples of the robot that are not judged yet."""
        samples = self._samples[robot]
        if len(samples.at) > samples.judged:
            q = self._world.models[robot].coupling.joints(np.array(samples.axes))
            self._within_limits(robot, q, samples)
            if self._planned:
                self._on_a_planned_path(robot, q, samples)
            samples.forget(min(_BEFORE, len(q)))

    def _within_limits(self, robot: str, q: NDArray[np.float64], samples: _Samples) -> None:
        first = max(_BEFORE - 1, samples.judged)
        limits, dt = self._world.planners[robot].limits, self._world.cycle_s(robot)
        rows = q
        for order, what, allowed in (
            (1, "velocity", limits.velocity),
            (2, "acceleration", limits.ramp_acceleration_bounds[1]),
            (3, "jerk", limits.ramp_jerk),
        ):
            rows = np.diff(rows, axis=0) / dt
            found = rows[first - order :]
            beyond = np.flatnonzero((np.abs(found) > allowed * _LIMIT_TOLERANCE).any(axis=1))
            if len(beyond):
                at, worst = samples.at[first + beyond[0]], found[beyond[0]]
                raise Broken(f"at {at:.3f} s {robot}: {what} {worst}, allowed {allowed}")

    def _on_a_planned_path(self, robot: str, q: NDArray[np.float64], samples: _Samples) -> None:
        first = max(1, samples.judged)
        moved = first + np.flatnonzero((q[first:] != q[first - 1 : -1]).any(axis=1))
        motions = [planned.motion for planned in self._world.seen.planned[robot][: samples.plans]]
        off = self._paths.off(motions, q[moved], _ON_PATH_RAD)
        if (off > _ON_PATH_RAD).any():
            worst = int(off.argmax())
            raise Broken(f"at {samples.at[moved[worst]]:.3f} s {robot} is {off[worst]} rad off every planned path")

    def check_at_rest(self) -> None:
        """After the end nothing moves."""
        for robot, samples in self._samples.items():
            if len(samples.axes) > 1 and not np.array_equal(samples.axes[0], samples.axes[-1]):
                raise Broken(f"{robot} still moves at the end")
