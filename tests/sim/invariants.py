"""What must hold at every step of a simulated cell, whatever the network and the machines do."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from cell.geometry import capsules_touch_box, transform_points
from cell.messages import DriveFeedback, ZoneGeometry
from robot_agent.agent.axes import feedback_in_joints
from robot_agent.trajectory import Motion
from robot_agent.workspace import zone_box
from tests.sim.world import World

_ON_PATH_RAD = 2e-6
_LIMIT_TOLERANCE = 1.01
_PATH_STEP_S = 0.001
_PASSES_RAD = 2e-3
"""More than the joints move in a step."""
_BODY_EVERY_TICKS = 2


class Broken(AssertionError):
    """An invariant does not hold."""


class Invariants:
    """Watches the drives: what they are commanded, and where they really are."""

    def __init__(self, world: World, planned: bool = True) -> None:
        """`planned`: robots move on planned paths only; false where they are jogged."""
        self._world = world
        self._planned = planned
        self._inside: dict[str, dict[str, bool]] = {}
        self._last: dict[str, deque[NDArray[np.float64]]] = {}
        self._paths: dict[int, NDArray[np.float64]] = {}
        self.samples = 0
        self.time_inside_s = dict.fromkeys(world.cell.robots, 0.0)
        zones = world.cell.zones.values()
        self._boxes = {
            zone.name: zone_box(
                ZoneGeometry(zone.name, 1, zone.size_m, zone.pose.position_m, zone.pose.quaternion_xyzw, zone.robots)
            )
            for zone in zones
        }
        world.on_feedback.append(self.look)

    def look(self, feedback: DriveFeedback) -> None:
        """One cycle of one robot."""
        feedback = feedback_in_joints(self._world.models[feedback.robot].coupling, feedback)
        if feedback.tick % _BODY_EVERY_TICKS == 0:
            self._one_body_in_a_zone(feedback)
        last = self._last.setdefault(feedback.robot, deque(maxlen=4))
        if not feedback.enabled:
            last.clear()
            return
        last.append(feedback.commanded)
        self.samples += 1
        self._within_limits(feedback, last)
        if self._planned and len(last) > 1 and not np.array_equal(last[-1], last[-2]):
            self._on_a_planned_path(feedback)

    def _one_body_in_a_zone(self, feedback: DriveFeedback) -> None:
        robot = feedback.robot
        planner, model = self._world.planners[robot], self._world.models[robot]
        points = transform_points(planner.pose_world_base, model.capsules(self._measured(feedback)))
        for name, box in self._boxes.items():
            inside = self._inside.setdefault(name, {})
            inside[robot] = bool(capsules_touch_box(points, model.capsule_radii, box).any())
            if inside[robot]:
                self.time_inside_s[robot] += _BODY_EVERY_TICKS * self._world.cycle_s(robot)
            if sum(inside.values()) > 1:
                raise Broken(f"at {self._world.clock.now:.3f} s {sorted(inside)} are in zone {name} together")

    def _measured(self, feedback: DriveFeedback) -> NDArray[np.float64]:
        """The joints by the simulated axes themselves, not by what anyone reports of them."""
        gateway = f"gateway/{self._world.cell.robots[feedback.robot].gateway}"
        axes = self._world.bundle.gateways[gateway.partition("/")[2]].robots[feedback.robot].axes
        nodes = self._world.buses[gateway].nodes
        measured = np.array(
            [nodes[a.node_id].drives[a.number - 1].position / a.counts_per_unit + a.offset for a in axes]
        )
        return self._world.models[feedback.robot].coupling.joints(measured)

    def _within_limits(self, feedback: DriveFeedback, last: deque[NDArray[np.float64]]) -> None:
        if len(last) < 4:
            return
        limits, dt = self._world.planners[feedback.robot].limits, self._world.cycle_s(feedback.robot)
        velocity = np.diff(np.array(last), axis=0) / dt
        acceleration = np.diff(velocity, axis=0) / dt
        jerk = np.diff(acceleration, axis=0) / dt
        for what, found, allowed in (
            ("velocity", velocity[-1], limits.velocity),
            ("acceleration", acceleration[-1], limits.ramp_acceleration_bounds[1]),
            ("jerk", jerk[-1], limits.ramp_jerk),
        ):
            if (np.abs(found) > allowed * _LIMIT_TOLERANCE).any():
                raise Broken(f"at {self._world.clock.now:.3f} s {feedback.robot}: {what} {found}, allowed {allowed}")

    def _on_a_planned_path(self, feedback: DriveFeedback) -> None:
        q = feedback.commanded
        nearest = np.inf
        for planned in reversed(self._world.seen.planned[feedback.robot]):
            nearest = min(nearest, self._distance(planned.motion, q))
            if nearest <= _ON_PATH_RAD:
                return
        raise Broken(f"at {self._world.clock.now:.3f} s {feedback.robot} is {nearest} rad off every planned path")

    def _distance(self, motion: Motion, q: NDArray[np.float64]) -> float:
        """Distance [rad] of `q` from the chords of densely sampled path."""
        path = self._paths.get(id(motion))
        if path is None:
            count = max(2, int(motion.duration_s / _PATH_STEP_S))
            path = self._paths[id(motion)] = motion.q(np.linspace(0.0, motion.duration_s, count))
        away = np.abs(path - q).max(axis=1)
        near = np.flatnonzero(away <= away.min() + _PASSES_RAD)  # a path may pass a place more than once
        first = np.clip((near[:, None] + [-1, 0]).ravel(), 0, len(path) - 2)
        start, way = path[first], path[first + 1] - path[first]
        share = np.clip(((q - start) * way).sum(1) / np.maximum((way * way).sum(1), 1e-30), 0.0, 1.0)
        return float(np.abs(start + share[:, None] * way - q).max(axis=1).min())

    def check_at_rest(self) -> None:
        """After the end nothing moves."""
        for robot, last in self._last.items():
            if len(last) > 1 and not np.array_equal(last[0], last[-1]):
                raise Broken(f"{robot} still moves at the end")
