"""A robot's own links that must not come into each other: which pairs of them can, and how far apart they are."""

import copy
from contextlib import suppress
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from cell.geometry import capsule_distance
from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics import Model, OpenMechanism
from robot_agent.model import TOOL
from robot_agent.workspace.cover import Cover

HELD = "part "
"""In front of the name of a part that the robot holds: a link may have the same name."""
_FEW = 500
"""So many distances are sooner known than which of them are needed."""
_POSES = 256
"""Sets of joints all over their limits, the same ones each time."""


class Itself:
    """The body of a robot as something that it must not touch: one column for each pair of capsules that can meet."""

    bodies = 2
    """Both of a pair move."""

    def __init__(self, model: Model) -> None:
        self._model = model
        self.margin_m = model.description.apart.margin_m
        self.pairs = _pairs(model)
        """`(2, p)` indices of `model.body`, the one nearer to the base first."""

    def clearance(self, points: Array, radii: Array, within: Array | float) -> Array:
        """Distance of each pair less the margin, `(m, p)` [m]; beyond `within` a bound from below.

        `points`: all capsules `(m, c, 2, 3)` [m], `radii` `(c,)`.
        """
        one, other = self.pairs
        if len(points) * len(one) <= _FEW:
            return capsule_distance(points[:, one], radii[one], points[:, other], radii[other]) - self.margin_m
        way, middle = points[..., 1, :] - points[..., 0, :], points.mean(axis=-2)
        balls = np.sqrt(np.einsum("...k,...k", way, way)) / 2.0 + radii
        between = middle[:, one] - middle[:, other]
        distance = np.sqrt(np.einsum("...k,...k", between, between)) - balls[:, one] - balls[:, other]
        sample, pair = np.nonzero(distance < within + self.margin_m)
        first, second = one[pair], other[pair]
        distance[sample, pair] = capsule_distance(
            points[sample, first], radii[first], points[sample, second], radii[second]
        )
        return np.asarray(distance - self.margin_m)

    def nearer(self, points: Array, radii: Array, than: Array) -> Flags:
        """As `KeptAway`."""
        return np.asarray((self.clearance(points, radii, than) < than).any(axis=0))

    def way(self, ways: Array) -> Array:
        """How far both of each pair go together `(m, p)` [m], from how far the capsules go `(m, c)`."""
        one, other = self.pairs
        return np.asarray(ways[:, one] + ways[:, other])

    def among(self, columns: NDArray[np.intp]) -> "Itself":
        """As `KeptAway`."""
        some = copy.copy(self)
        some.pairs = self.pairs[:, columns]
        return some

    def roughly_near(self, cover: Cover) -> Flags:
        """Which pairs may come too near by the balls around them, and when: `(b, p)`, by stretches of the cover."""
        one, other = self.pairs
        between = cover.centres[:, one] - cover.centres[:, other]
        reach = cover.balls[:, one] + cover.balls[:, other] + self.margin_m
        return np.asarray(np.einsum("...k,...k", between, between) < reach * reach)

    def near(self, cover: Cover) -> Flags:
        """The same, and less of them, by the capsules."""
        one, other = self.pairs
        near = self.roughly_near(cover)
        stretch, pair = np.nonzero(near)
        first, second = (stretch, one[pair]), (stretch, other[pair])
        distance = capsule_distance(cover.points[first], cover.radii[first], cover.points[second], cover.radii[second])
        near[stretch, pair] = distance < self.margin_m
        return near

    def names(self, column: int) -> tuple[str, str]:
        """For people: the part farther from the base, and to what it comes too near."""
        one, other = (part_of(self._model, int(capsule)) for capsule in self.pairs[:, column])
        return other, named(one)

    def parts(self) -> list[tuple[str, str]]:
        """The names of the pairs, each once."""
        return list(dict.fromkeys((part_of(self._model, a), part_of(self._model, b)) for a, b in self.pairs.T.tolist()))


def part_of(model: Model, capsule: int) -> str:
    """The name of the link that a capsule belongs to; `TOOL` for the mounted tool, `HELD` and its name for a part."""
    described = model.description
    own, tools = len(described.capsules), (described.tools[name] for name in described.mounted.tools)
    if capsule < own:
        return model.link_names[model.body[capsule].link]
    behind = capsule - own - sum(len(tool.capsules) for tool in tools)
    if behind < 0:
        return TOOL
    places = len(described.poses_flange_tcp)
    held = [name for name in described.mounted.parts for _ in range(places * len(described.parts[name].capsules))]
    return HELD + held[behind]


def as_written(part: str) -> str:
    """What files call it."""
    return part.removeprefix(HELD)


def owned_by(part: str) -> str:
    """A part as it stands after the name of its robot: left's forearm, left's link 4, left's tool."""
    own = part != TOOL and not part.startswith(HELD)
    return part.replace("_", " ") if own and not part.isdigit() else named(part).removeprefix("the ")


def named(part: str) -> str:
    """A part as it stands in a sentence."""
    return f"the {part}" if part == TOOL or part.startswith(HELD) else f"link {part}"


def _pairs(model: Model) -> NDArray[np.intp]:
    """Pairs of capsules that can meet and must not.

    Left out are those of one link, those of links that a joint holds together, those that the robot file lets touch,
    and those that are nearer than the margin in every pose. Tool and part also keep away from the link before the
    flange, and not from each other.
    """
    links, parts = [each.link for each in model.body], [part_of(model, i) for i in range(len(model.body))]
    joined, apart, own = model.joined_links(), model.description.apart, len(model.description.capsules)
    free = {frozenset(pair) for pair in apart.may_touch}

    def counts(one: int, other: int) -> bool:
        held = max(one, other) < own and (links[one], links[other]) in joined
        names = frozenset((as_written(parts[one]), as_written(parts[other])))
        return links[one] != links[other] and not held and names not in free

    outwards = sorted(range(len(links)), key=links.__getitem__)
    pairs = np.array([pair for pair in combinations(outwards, 2) if counts(*pair)], dtype=np.intp).reshape(-1, 2).T
    (one, other), radii, points = pairs, model.capsule_radii, _poses(model)
    distances = capsule_distance(points[:, one], radii[one], points[:, other], radii[other])
    return pairs[:, (distances >= apart.margin_m).any(axis=0)]


def _poses(model: Model) -> Array:
    """Capsules `(m, c, 2, 3)` [m] at joints all over their limits, where the mechanism can be there."""
    lower, upper = model.limits.position.T
    joints = np.random.default_rng(0).uniform(lower, upper, (_POSES, model.n))
    with suppress(OpenMechanism):
        return model.capsules(joints)
    found = []
    for q in joints:
        with suppress(OpenMechanism):
            found.append(model.capsules(q))
    return np.array(found).reshape(-1, len(model.body), 2, 3)
