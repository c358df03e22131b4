"""Bodies that are in each other while all robots are at home."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from cell.commands.checks.readings import Readings
from cell.config.problem import Problem
from cell.geometry import pose_from, segment_distance, transform_points
from cell.geometry.arrays import Array
from robot_agent.kinematics import Model


def check_bodies(readings: Readings, models: dict[str, Model]) -> Iterator[Problem]:
    """Two robots whose capsules overlap at their home positions."""
    bodies = {
        robot: _at_home(readings, robot, model) for robot, model in models.items() if robot in readings.cell.robots
    }
    for one, other in combinations(bodies, 2):
        distances = segment_distance(bodies[one][:, None], bodies[other][None])
        gaps = distances - models[one].capsule_radii[:, None] - models[other].capsule_radii
        if gaps.min() <= 0:
            mine, its = np.unravel_index(int(gaps.argmin()), gaps.shape)
            parts = f"link {_link(models[other], int(its))} of {other}, link {_link(models[one], int(mine))} of {one}"
            found = f"{other} at home {-1000 * gaps.min():.0f} mm deep in {one} at home: {parts}"
            allowed = f"a base, or a home position, at which {other} and {one} are apart"
            yield readings.document.problem(("robots", other, "base"), found, allowed, at_key=True)


def _at_home(readings: Readings, robot: str, model: Model) -> Array:
    """Capsules at home in world `(c, 2, 3)`."""
    base = readings.cell.robots[robot].base.settings()
    pose = pose_from(np.array(base.position_m), np.array(base.quaternion_xyzw))
    return transform_points(pose, model.capsules(model.home))


def _link(model: Model, capsule: int) -> str:
    return model.link_names[model.body[capsule].link]
