"""Bodies that are in each other while all robots are at home: two robots, or two links of one."""

from collections.abc import Iterator
from contextlib import suppress
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from cell.commands.checks.readings import Readings
from cell.config.document import Document
from cell.config.problem import Problem, Severity
from cell.geometry import capsule_distance, transform_points
from cell.geometry.arrays import Array
from robot_agent.kinematics import Model, OpenMechanism
from robot_agent.workspace import PlacedRobot

POSES = 64
"""Joint sets by which links that touch at home only are told from those that always do."""


def check_bodies(readings: Readings, models: dict[str, Model]) -> Iterator[Problem]:
    """Robots whose capsules overlap at their home positions, an error, and links of one that do so, a warning."""
    for robot, document, _ in readings.named.usable_models():
        if robot in models:
            yield from _within(document, models[robot])
    yield from _between(readings, models)


def _within(document: Document, model: Model) -> Iterator[Problem]:
    """Links of one robot that no joint holds together, in each other at home although they could be apart."""
    links = np.array([capsule.link for capsule in model.body])
    one, other = np.triu_indices(len(links), 1)
    joined = model.joined_links()
    numbers = np.sort(np.stack([links[one], links[other]]), axis=0).T.tolist()
    apart = [first != second and (first, second) not in joined for first, second in numbers]
    pairs = np.stack([one, other])[:, apart]
    at_home = _gaps(model, model.home, pairs)
    if at_home.size == 0 or at_home.min() > 0:
        return
    ever_apart = np.zeros(at_home.shape, dtype=bool)
    lower, upper = model.limits.position.T
    for q in np.random.default_rng(0).uniform(lower, upper, (POSES, model.n)):
        with suppress(OpenMechanism):
            ever_apart |= _gaps(model, q, pairs) > 0
    depths: dict[str, float] = {}
    for i in np.flatnonzero((at_home <= 0) & ever_apart):
        names = " and ".join(_link(model, int(capsule)) for capsule in pairs[:, i])
        depths[names] = max(depths.get(names, 0.0), -1000 * float(at_home[i]))
    if depths:
        found = "links deep in each other: " + ", ".join(f"{names} {depth:.0f} mm" for names, depth in depths.items())
        allowed = "a home position at which they are apart, or slimmer capsules where the robot is slimmer"
        yield document.problem(("home",), found, allowed, severity=Severity.WARNING, at_key=True)


def _gaps(model: Model, q: Array, pairs: NDArray[np.intp]) -> Array:
    """Distances [m] between the capsules of pairs `(2, p)` at joints `(n,)`; negative where they overlap."""
    (one, other), ends, radii = pairs, model.capsules(q), model.capsule_radii
    return capsule_distance(ends[one], radii[one], ends[other], radii[other])


def _between(readings: Readings, models: dict[str, Model]) -> Iterator[Problem]:
    bodies = {
        robot: _at_home(readings, robot, model) for robot, model in models.items() if robot in readings.cell.robots
    }
    for one, other in combinations(bodies, 2):
        mine_m, its_m = models[one].capsule_radii[:, None], models[other].capsule_radii
        gaps = capsule_distance(bodies[one][:, None], mine_m, bodies[other], its_m)
        if gaps.min() <= 0:
            mine, its = np.unravel_index(int(gaps.argmin()), gaps.shape)
            parts = f"link {_link(models[other], int(its))} of {other}, link {_link(models[one], int(mine))} of {one}"
            found = f"{other} at home {-1000 * gaps.min():.0f} mm deep in {one} at home: {parts}"
            allowed = f"a base, or a home position, at which {other} and {one} are apart"
            yield readings.document.problem(("robots", other, "base"), found, allowed, at_key=True)


def _at_home(readings: Readings, robot: str, model: Model) -> Array:
    """Capsules at home in world `(c, 2, 3)`."""
    placed = PlacedRobot.at(model, readings.cell.robots[robot].base.settings())
    return transform_points(placed.pose_world_base, model.capsules(model.home))


def _link(model: Model, capsule: int) -> str:
    return model.link_names[model.body[capsule].link]
