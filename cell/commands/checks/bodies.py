"""Bodies that are in each other while all robots are at home: two robots, or two links of one."""

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from cell.commands.checks.readings import Readings
from cell.config.document import Document
from cell.config.frame_entry import FrameTree
from cell.config.problem import Problem
from cell.geometry import nearest_capsules
from robot_agent.kinematics import Model
from robot_agent.workspace import Itself, PlacedRobot, named, part_of


def check_bodies(readings: Readings, models: dict[str, Model]) -> Iterator[Problem]:
    """Robots whose capsules overlap at their home positions, and links of one that are too near to each other there."""
    for robot, document, _ in readings.named.usable_models():
        if robot in models:
            yield from _within(document, models[robot])
    yield from _between(readings, models)


def _within(document: Document, model: Model) -> Iterator[Problem]:
    """Links of one robot that are too near to each other at home, where it could not begin any motion."""
    itself = Itself(model)
    near = itself.clearance(model.capsules(model.home)[None], model.capsule_radii, within=0.0)[0]
    missing_mm: dict[str, float] = {}
    for column in np.flatnonzero(near < 0.0):
        part, other = itself.names(int(column))
        names = f"{named(part)} to {other}"
        missing_mm[names] = max(missing_mm.get(names, 0.0), -1000.0 * float(near[column]))
    if missing_mm:
        told = ", ".join(f"{names} {each:.0f} mm" for names, each in missing_mm.items())
        found = f"links too near to each other (margin {1000.0 * itself.margin_m:g} mm): {told}"
        allowed = "a home position at which they are apart, slimmer capsules where the robot is slimmer, or pairs that"
        allowed += " may touch under self_collision"
        yield document.problem(("home",), found, allowed, at_key=True)


def _between(readings: Readings, models: dict[str, Model]) -> Iterator[Problem]:
    bodies = {robot: each.body_at_home for robot, each in placed(readings, models).items()}
    for one, other in combinations(bodies, 2):
        both = [bodies[each][None] for each in (one, other)]
        touching = nearest_capsules(both, [models[each].capsule_radii for each in (one, other)], within=0.0)
        if touching is not None:
            its_part = named(part_of(models[other], touching.other_capsule))
            my_part = named(part_of(models[one], touching.capsule))
            parts = f"{its_part} of {other}, {my_part} of {one}"
            found = f"{other} at home {-1000 * touching.distance_m:.0f} mm deep in {one} at home: {parts}"
            allowed = f"a base, or a home position, at which {other} and {one} are apart"
            yield readings.document.problem(("robots", other, "base"), found, allowed, at_key=True)


def placed(readings: Readings, models: dict[str, Model]) -> dict[str, PlacedRobot]:
    """The robots whose model is known, at their bases in world, without things and spaces."""
    frames = FrameTree(readings.cell.frames)
    return {
        robot: PlacedRobot.at(models[robot], frames.in_world(entry.base.settings(), entry.frame))
        for robot, entry in readings.cell.robots.items()
        if robot in models
    }
