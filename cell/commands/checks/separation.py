"""What `separation` means in this cell: homes that are too near, and robots that stand while another one is lost."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cell.commands.checks.bodies import placed
from cell.commands.checks.readings import Readings
from cell.config.problem import KeyPath, Problem, Severity
from cell.config.settings import SeparationSettings
from cell.geometry import capsule_distance
from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics import Model
from robot_agent.workspace import FOLLOWING_M, ROOM_M, PlacedRobot, named, part_of

AROUND_M = FOLLOWING_M + ROOM_M
"""Reserved around a robot that stands."""
_CANNOT, _OUTSIDE = "cannot move", "moves only outside its reach"


@dataclass(frozen=True, slots=True)
class Apart:
    """Two robots of a cell that keeps them apart; lengths in m."""

    robots: tuple[str, str]
    margin_m: float
    home_m: float
    """Between their bodies at home, those of two bases excepted."""
    links: tuple[str, str]
    """The two that are the nearest there, as people call them."""
    bases_m: float
    reaches_m: tuple[float, float]
    fixed: tuple[bool, bool]
    """Whether the base of either is within the reach of the other one, or within the margin of that."""

    @property
    def notes(self) -> list[str]:
        """What becomes of either while the other one does not know where it is; empty where they do not reach it."""
        if self.bases_m >= sum(self.reaches_m) + self.margin_m:
            return []
        lost = zip(self.robots, self.robots[::-1], self.reaches_m[::-1], self.fixed, strict=True)
        bases = f"their bases are {1000 * self.bases_m:.0f} mm apart."
        return [
            f"While {other} does not know where it is, {one} {_CANNOT if held else _OUTSIDE}: "
            f"{other} reaches {1000 * reach_m:.0f} mm, {bases}"
            for one, other, reach_m, held in lost
        ]


def robots_apart(separation: SeparationSettings, robots: Mapping[str, PlacedRobot]) -> list[Apart]:
    """Each pair of robots."""
    return [
        _apart(separation.margin_of(one, other), (one, other), (robots[one], robots[other]))
        for one, other in combinations(robots, 2)
    ]


def check_separation(readings: Readings, models: dict[str, Model]) -> Iterator[Problem]:
    """Robots that could not both stand at home: what is reserved for them there is nearer than the margin.

    Homes that are in each other are no finding here: no cell may have them.
    """
    separation = readings.cell.kept_apart()
    if separation is None:
        return
    for pair in robots_apart(separation, placed(readings, models)):
        needed_m = pair.margin_m + 2.0 * AROUND_M
        if not 0.0 < pair.home_m < needed_m:
            continue
        (one, other), (link, other_link) = pair.robots, pair.links
        found = (
            f"{one} and {other} {1000 * pair.home_m:.0f} mm apart at home ({link} of {one}, {other_link} of {other}): "
            "they cannot both stand there"
        )
        allowed = (
            f"{1000 * needed_m:g} mm or more, the margin and {1000 * AROUND_M:g} mm around each: bases or homes "
            "farther apart, or a smaller margin of these two under separation.pairs"
        )
        key = _key(readings, pair)
        yield readings.document.problem(key, found, allowed, severity=Severity.WARNING, at_key=True)


def _apart(margin_m: float, names: tuple[str, str], robots: tuple[PlacedRobot, PlacedRobot]) -> Apart:
    (body, radii, moves), (other_body, other_radii, others_move) = map(_body, robots)
    away = capsule_distance(body[:, None], radii[:, None], other_body, other_radii)
    away[~(moves[:, None] | others_move)] = np.inf
    link, other_link = np.unravel_index(int(away.argmin()), away.shape)
    bases = [each.pose_world_base[:3, 3] for each in robots]
    reaches = [each.model.reach_m for each in robots]
    from_other = capsule_distance(body, radii, np.array([bases[1]] * 2), np.array(reaches[1]))
    from_one = capsule_distance(other_body, other_radii, np.array([bases[0]] * 2), np.array(reaches[0]))
    near_m = margin_m + FOLLOWING_M  # sections are so much thicker than a robot
    return Apart(
        names,
        margin_m,
        float(away.min()),
        (named(part_of(robots[0].model, int(link))), named(part_of(robots[1].model, int(other_link)))),
        float(np.linalg.norm(bases[1] - bases[0])),
        (reaches[0], reaches[1]),
        (bool((from_other[~moves] <= near_m).any()), bool((from_one[~others_move] <= near_m).any())),
    )


def _body(robot: PlacedRobot) -> tuple[Array, Array, Flags]:
    """Capsules at home in world `(c, 2, 3)`, their radii, and which of them ever move."""
    model = robot.model
    return robot.body_at_home, model.capsule_radii, np.array([each.link != 0 for each in model.body])


def _key(readings: Readings, pair: Apart) -> KeyPath:
    """Where the margin of two robots is said."""
    separation = readings.cell.separation
    for index, each in enumerate(() if separation is None else separation.pairs):
        if set(each.robots) == set(pair.robots):
            return "separation", "pairs", index, "margin"
    given = "separation" in readings.document.keys(())
    return ("separation",) if given else ("robots", pair.robots[1], "base")
