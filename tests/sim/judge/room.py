"""Robots that share room without zones: who may be where, by the drives themselves and by what the manager keeps.

No rule of the product is used: what was asked for, cleared and taken is known from the messages, and distances are
measured between all capsules.
"""

import itertools
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from cell.geometry import Box, capsule_distance
from cell.messages import (
    Clearance,
    DriveFeedback,
    ManagerState,
    Mode,
    PlayoutState,
    Presence,
    RobotState,
    Sections,
    SetpointBlock,
)
from tests.sim.judge.facts import Facts, Floats, Sample
from tests.sim.judge.invariant import Handlers, Invariant

_TOLERANCE_M = 0.002
_ROUNDING_M = 1e-4
_ROOM_M = 0.03
"""So much room a robot keeps around it while it stands, for what it may follow behind and for what it is pushed."""
_WITHIN_M = 0.001
_EACH = 4
"""Every so many rows of a motion are looked at, and the last one."""

Pair = frozenset[str]


def _misses(points: Floats, radii: Floats, sections: Sections) -> float:
    """How far the body that is farthest out, of `(m, c, 2, 3)` with radii `(c,)`, is outside of all sections [m]."""
    c = points.shape[1]
    if not len(sections):
        return np.inf
    away = np.linalg.norm(points[:, None] - sections.points[None, :, :c], axis=-1).max(axis=-1)
    return float((away + radii - sections.radii[None, :, :c]).max(axis=-1).min(axis=1).max())


def _leaves(points: Floats, radii: Floats, box: Box) -> float:
    """How far the body that is farthest out, as in `_misses`, is outside of a box [m]; below zero: inside."""
    local = (points - box.pose_world_box[:3, 3]) @ box.pose_world_box[:3, :3]
    return float((np.abs(local) - 0.5 * box.size + radii[:, None, None]).max())


def _some(rows: Floats) -> Floats:
    return np.concatenate([rows[:-1:_EACH], rows[-1:]])


class KeptApart(Invariant):
    """Two real bodies keep their margin. Where a drive that fails has brought them, with the room that they keep around
    them, nearer than that, they do not approach each other any more once it is in order, until they have parted."""

    name = "robots are kept apart"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._newest: dict[str, Sample] = {}
        self._brought: dict[Pair, float] = {}
        """Robots that a drive has brought near each other, and how near [m]."""

    def look(self, sample: Sample) -> None:
        separation = self.facts.cell.separation
        if separation is None:
            return
        self._newest[sample.robot] = sample
        for other, its in self._newest.items():
            if other == sample.robot:
                continue
            pair, margin = frozenset((sample.robot, other)), separation.margin_of(sample.robot, other)
            away = self._away(sample, its)
            if away >= margin + 3 * _ROOM_M:
                self._brought.pop(pair, None)
            elif any(self.facts.hindered(robot, sample.at) for robot in pair):
                self._brought[pair] = min(away, self._brought.get(pair, away))
            elif away < min(margin - _TOLERANCE_M, self._brought.get(pair, np.inf) - _ROOM_M):
                what = f"they are {1000 * away:.1f} mm apart, {1000 * margin:g} mm are kept"
                self.broken(f"{sample.robot} and {other}", what, sample.at)

    @property
    def too_near(self) -> bool:
        """Whether two robots are nearer than their margin at present."""
        separation = self.facts.cell.separation
        pairs = itertools.combinations(self._newest.values(), 2)
        return separation is not None and any(
            self._away(one, other) < separation.margin_of(one.robot, other.robot) for one, other in pairs
        )

    def _away(self, one: Sample, other: Sample) -> float:
        """Between what moves of either and all of the other [m]."""
        (first, first_radii, first_moves), (second, second_radii, second_moves) = map(self._body, (one, other))
        away = capsule_distance(first[:, None], first_radii[:, None], second[None], second_radii[None])
        return float(away[first_moves[:, None] | second_moves[None]].min())

    def _body(self, sample: Sample) -> tuple[Floats, Floats, np.ndarray]:
        model = self.facts.world.models[sample.robot]
        return sample.points, model.capsule_radii, np.array([each.link != 0 for each in model.body])


class BodyIsOwned(Invariant):
    """The real body lies within one of the sections that its robot owns by its newest presence, however old that is,
    also while drives brake by themselves; one that a drive has brought elsewhere excepted, until that is said."""

    name = "the real body is in owned space"

    def look(self, sample: Sample) -> None:
        if self.facts.cell.separation is None or sample.shown is None:
            return
        presence = sample.shown.message
        hindered = self.facts.hindered(sample.robot, sample.at) or self.facts.hindered(sample.robot, sample.shown.at)
        if hindered or not presence.body.known:
            return
        owned = presence.way.sections[: presence.way.owned]
        outside = _misses(sample.points[None], self.facts.world.models[sample.robot].capsule_radii, owned)
        if outside > _TOLERANCE_M:
            age_s = sample.at - sample.shown.at
            what = f"it is {1000 * outside:.1f} mm out of what it said {age_s:.3f} s before that it owns"
            self.broken(sample.robot, what, sample.at)


class BlockIsOwned(Invariant):
    """Every block that moves its robot leads only through sections that the presence before it calls committed."""

    name = "blocks keep to owned space"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._presence: dict[tuple[str, int], Presence] = {}

    @property
    def published(self) -> Handlers:
        if self.facts.cell.separation is None:
            return {}
        return {Presence: self._said, SetpointBlock: self._sent}

    def _said(self, _: str, presence: Presence) -> None:
        self._presence[presence.robot, presence.owner] = presence

    def _sent(self, _: str, block: SetpointBlock) -> None:
        if np.ptp(block.position, axis=0).max(initial=0.0) == 0.0:
            return
        presence = self._presence.get((block.robot, block.owner))
        if presence is None or not presence.body.known:
            self.broken(block.robot, f"block {block.sequence} moves it, and it has not said where it is")
        committed = presence.way.sections[: presence.way.committed]
        points = self.facts.points(block.robot, _some(block.position))
        outside = _misses(points, self.facts.world.models[block.robot].capsule_radii, committed)
        if outside > _WITHIN_M:
            what = f"block {block.sequence} leads {1000 * outside:.1f} mm out of what its robot has committed"
            self.broken(block.robot, what)


class QueueIsReserved(Invariant):
    """What a gateway has queued, up to rest, lies in what the manager that lives has reserved for the robot, once that
    has heard of it; a robot that a drive brought elsewhere excepted."""

    name = "what is queued is reserved"
    _EVERY_S = 0.2

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._looked_at: dict[str, float] = {}
        self._elsewhere: set[str] = set()
        """Robots that were hindered, until the manager has heard a presence of afterwards."""

    @property
    def published(self) -> Handlers:
        return {} if self.facts.cell.separation is None else {DriveFeedback: self._look}

    @property
    def delivered(self) -> Handlers:
        return {} if self.facts.cell.separation is None else {Presence: self._heard}

    def _heard(self, name: str, presence: Presence) -> None:
        at = self.facts.sent.get((presence.boot, presence.sequence), -np.inf)
        if name == "manager" and not self.facts.hindered(presence.robot, at):
            self._elsewhere.discard(presence.robot)

    def _look(self, _: str, feedback: DriveFeedback) -> None:
        robot, facts = feedback.robot, self.facts
        if facts.hindered(robot):
            self._elsewhere.add(robot)
        if facts.now - self._looked_at.get(robot, -np.inf) < self._EVERY_S or robot in self._elsewhere:
            return
        self._looked_at[robot] = facts.now
        queued, reserved = facts.queued(robot), facts.reserved(robot)
        if queued is None or reserved is None:
            return
        radii = facts.world.models[robot].capsule_radii
        leaves = _leaves if isinstance(reserved, Box) else _misses
        outside = leaves(facts.points(robot, _some(queued)), radii, reserved)
        if outside > _WITHIN_M:
            self.broken(robot, f"its gateway has queued what leads {1000 * outside:.1f} mm out of what is reserved")


@dataclass(slots=True)
class _Claimed:
    """What an agent has said last under one claim."""

    epoch: int = 0
    taken: int = 0
    owned: frozenset[int] = frozenset()
    asked: dict[int, list[int]] = field(default_factory=dict)
    """By sequence of a presence, the sections that it asked for."""


class OwnedIsCleared(Invariant):
    """What an agent comes to own was cleared for it, for this claim, by the newest manager that it knows, by a
    clearance that it takes now: none counts twice, late, or for another. Where a robot stands, and where its drives
    brake by themselves, it owns by force."""

    name = "owned space was cleared"
    _BRAKES_S = 0.5
    """So long after its drives were last seen off or braking, an agent may not have heard that they are not."""

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._claimed: dict[tuple[str, int], _Claimed] = {}
        self._clearances: dict[tuple[str, int, int], Clearance] = {}
        """By robot, epoch and number."""
        self._stopped_at: dict[str, float] = {}
        """When a robot's drives were last seen off, or braking by themselves."""
        self._commanded: dict[str, Floats] = {}
        self._led: dict[str, bool] = {}
        """Whether what was commanded last is another place than before; drives that are behind still settle."""

    @property
    def published(self) -> Handlers:
        if self.facts.cell.separation is None:
            return {}
        return {Presence: self._said, Clearance: self._answered, DriveFeedback: self._measured}

    def _answered(self, _: str, clearance: Clearance) -> None:
        self._clearances.setdefault((clearance.robot, clearance.epoch, clearance.number), clearance)

    def _measured(self, _: str, feedback: DriveFeedback) -> None:
        before = self._commanded.get(feedback.robot)
        self._led[feedback.robot] = before is None or not np.array_equal(before, feedback.commanded)
        self._commanded[feedback.robot] = feedback.commanded
        if not feedback.enabled or feedback.state in (
            PlayoutState.FOLLOWING,
            PlayoutState.STOPPING,
            PlayoutState.FAULT,
        ):
            self._stopped_at[feedback.robot] = self.facts.now

    def _said(self, _: str, presence: Presence) -> None:
        way, key = presence.way, (presence.robot, presence.owner)
        claimed = self._claimed.setdefault(key, _Claimed(epoch=presence.epoch))
        ids = way.sections.ids.tolist()
        if presence.epoch < claimed.epoch:
            self.broken(presence.robot, f"it knew of epoch {claimed.epoch}, and names {presence.epoch}")
        before = claimed.taken if presence.epoch == claimed.epoch else 0
        if presence.taken < before:
            self.broken(presence.robot, f"it had taken clearance {before}, and takes {presence.taken}")
        new = frozenset(ids[: way.owned]) - claimed.owned
        if new:
            new -= frozenset(self._cleared(presence, claimed, before))
        for at, section in enumerate(ids[: way.owned]):
            if section in new and not self._by_force(presence, way.sections[at : at + 1]):
                what = f"it owns section {at} of its way, which no clearance up to {presence.taken} gives it"
                self.broken(presence.robot, what)
        claimed.asked[presence.sequence] = ids[way.owned :]
        claimed.epoch, claimed.taken, claimed.owned = presence.epoch, presence.taken, frozenset(ids[: way.owned])

    def _cleared(self, presence: Presence, claimed: _Claimed, before: int) -> Iterator[int]:
        """What the clearances that this presence confirms give."""
        for number in range(before + 1, presence.taken + 1):
            clearance = self._clearances.get((presence.robot, presence.epoch, number))
            if clearance is not None and clearance.owner == presence.owner:
                yield from claimed.asked.get(clearance.presence, [])[: clearance.cleared]

    def _by_force(self, presence: Presence, section: Sections) -> bool:
        robot, facts = presence.robot, self.facts
        if facts.hindered(robot) or facts.now - self._stopped_at.get(robot, -np.inf) < self._BRAKES_S:
            return True
        c = facts.world.models[robot].capsule_radii
        points = facts.points(robot, facts.measured(robot)[None])[0]
        away = np.linalg.norm(points - section.points[0, : len(c)], axis=-1).max()
        grown = (section.radii[0, : len(c)] - c).max()
        stands = not facts.moving(robot) or not self._led.get(robot, True)
        return stands and float(away) < _ROOM_M and float(grown) < _ROOM_M


class OwnedKeptApart(Invariant):
    """What two robots own by their newest presences is never nearer than their margin, but where one owns by force what
    the manager had not heard of when it cleared the other's; then until they have parted. When an operator says in
    which box a robot stays whose agent does not run, that takes the place of what the robot owned."""

    name = "owned space is kept apart"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._owned: dict[str, Sections] = {robot: Sections() for robot in facts.robots}
        self._asked: dict[tuple[str, int, int], list[int]] = {}
        self._cleared_at: dict[str, dict[int, float]] = defaultdict(dict)
        """By robot, when each section that is on its way was last cleared for it."""
        self._heard_at: dict[str, dict[int, float]] = defaultdict(dict)
        """By robot, since when a manager is told that it owns a section."""
        self._measured: dict[tuple[str, str], dict[tuple[int, int], float]] = defaultdict(dict)
        """By two robots and a section of each, how far these are apart [m], where that is less than the margin."""
        self._tangled: set[Pair] = set()
        """Robots too near to each other by force."""
        self._assured: set[str] = set()

    @property
    def published(self) -> Handlers:
        if self.facts.cell.separation is None:
            return {}
        return {Presence: self._said, Clearance: self._answered, ManagerState: self._keeps}

    @property
    def delivered(self) -> Handlers:
        return {} if self.facts.cell.separation is None else {Presence: self._heard}

    def _keeps(self, _: str, state: ManagerState) -> None:
        for robot in state.assured.keys() - self._assured:
            self._owned[robot] = Sections()
        self._assured = set(state.assured)

    def _answered(self, _: str, clearance: Clearance) -> None:
        asked = self._asked.get((clearance.robot, clearance.owner, clearance.presence), [])
        self._cleared_at[clearance.robot].update(dict.fromkeys(asked[: clearance.cleared], self.facts.now))

    def _heard(self, name: str, presence: Presence) -> None:
        if name == "manager":
            before, owned = self._heard_at[presence.robot], presence.way.sections.ids[: presence.way.owned].tolist()
            self._heard_at[presence.robot] = {section: before.get(section, self.facts.now) for section in owned}

    def _said(self, _: str, presence: Presence) -> None:
        robot, way = presence.robot, presence.way
        ids, cleared = way.sections.ids.tolist(), self._cleared_at[robot]
        self._asked[robot, presence.owner, presence.sequence] = ids[way.owned :]
        self._cleared_at[robot] = {section: cleared[section] for section in ids if section in cleared}
        owned = way.sections[: way.owned]
        new = ~np.isin(owned.ids, self._owned[robot].ids)
        self._owned[robot] = owned
        for other, its in self._owned.items():
            if other == robot or not len(its) or not len(owned):
                continue
            pair = frozenset((robot, other))
            some = owned if pair in self._tangled else owned[np.flatnonzero(new)]
            near = self._near(robot, some, other, its)
            if not near:
                self._tangled.discard(pair)
            for (section, its_section), away in near.items():
                if pair not in self._tangled and not self._forced(robot, section, other, its_section):
                    margin = 1000 * self._margin(robot, other)
                    what = f"they own sections that are {1000 * away:.1f} mm apart, {margin:g} mm are kept"
                    self.broken(f"{robot} and {other}", what)
            if near:
                self._tangled.add(pair)

    def _forced(self, robot: str, section: int, other: str, its: int) -> bool:
        """One of them is owned by force, and was not heard of when the other one was cleared."""
        mine, theirs = self._cleared_at[robot].get(section), self._cleared_at[other].get(its)
        if mine is None and theirs is None:
            return True
        if mine is not None and theirs is not None:
            return False
        heard = self._heard_at[robot].get(section) if mine is None else self._heard_at[other].get(its)
        cleared = theirs if mine is None else mine
        return heard is None or cleared is None or cleared <= heard

    def _margin(self, robot: str, other: str) -> float:
        separation = self.facts.cell.separation
        assert separation is not None
        return separation.margin_of(robot, other)

    def _near(self, robot: str, some: Sections, other: str, its: Sections) -> dict[tuple[int, int], float]:
        """The pairs of sections that are nearer than the margin, by their ids, and how near [m]."""
        margin, known = self._margin(robot, other) - _ROUNDING_M, self._measured[robot, other]
        pairs = [(one, two) for one in some.ids.tolist() for two in its.ids.tolist()]
        new = np.array([k for k, pair in enumerate(pairs) if pair not in known], dtype=np.intp)
        if len(new):
            away = self._away(robot, some[new // len(its)], other, its[new % len(its)], margin)
            known.update((pairs[k], each) for k, each in zip(new.tolist(), away.tolist(), strict=True))
        return {pair: known[pair] for pair in pairs if known[pair] < margin}

    def _away(self, robot: str, some: Sections, other: str, its: Sections, within: float) -> Floats:
        """Between sections `(s,)` of one robot and as many of the other [m], infinite where that is not `within`."""
        (low, high), (its_low, its_high) = _boxes(some), _boxes(its)
        meet = (low[:, :, None] - within < its_high[:, None]).all(axis=-1)
        meet &= (its_low[:, None] - within < high[:, :, None]).all(axis=-1)
        meet &= self._moves(robot, meet.shape[1])[:, None] | self._moves(other, meet.shape[2])
        k, i, j = np.nonzero(meet)
        least = np.full(len(some), np.inf)
        points, its_points = some.points[k, i].astype(float), its.points[k, j].astype(float)
        radii, its_radii = some.radii[k, i].astype(float), its.radii[k, j].astype(float)
        np.minimum.at(least, k, capsule_distance(points, radii, its_points, its_radii))
        return least

    def _moves(self, robot: str, count: int) -> np.ndarray:
        """Which of so many capsules move; those behind the model's are of what it holds."""
        body = self.facts.world.models[robot].body
        return np.array([k >= len(body) or body[k].link != 0 for k in range(count)])


class BoxesAreLeftAlone(Invariant):
    """While an operator's word holds in which box a robot stays, no other one is cleared into that box."""

    name = "nobody is cleared into a box"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._ways: dict[tuple[str, int, int], Sections] = {}
        """What was asked for, by robot, claim and sequence of its presence."""
        self._boxes: dict[str, Box] = {}
        self._entered: list[tuple[str, str]] = []
        """Since the manager's newest state: who was cleared into whose box. The word may have ended just before."""

    @property
    def published(self) -> Handlers:
        if self.facts.cell.separation is None:
            return {}
        return {Presence: self._said, Clearance: self._answered, ManagerState: self._holds}

    def _said(self, _: str, presence: Presence) -> None:
        self._ways[presence.robot, presence.owner, presence.sequence] = presence.way.sections[presence.way.owned :]

    def _answered(self, _: str, clearance: Clearance) -> None:
        asked = self._ways.get((clearance.robot, clearance.owner, clearance.presence))
        if asked is None or not clearance.cleared:
            return
        for confined, box in self._boxes.items():
            if confined != clearance.robot and _reach_into(
                asked[: clearance.cleared], self._moving(clearance.robot), box
            ):
                self._entered.append((clearance.robot, confined))

    def _moving(self, robot: str) -> list[int]:
        return [k for k, each in enumerate(self.facts.world.models[robot].body) if each.link != 0]

    def _holds(self, _: str, state: ManagerState) -> None:
        boxes = {name: each.box for name, each in state.assured.items() if each.box is not None}
        for robot, confined in self._entered:
            if confined in boxes:
                self.broken(robot, f"it is cleared into the box in which {confined} stays")
        self._entered.clear()
        self._boxes = {name: Box.at(box.size_m, box.position_m, box.quaternion_xyzw) for name, box in boxes.items()}


def _reach_into(sections: Sections, capsules: list[int], box: Box) -> bool:
    """Whether one of these capsules of a section touches the inside of a box, by places along its axis."""
    pose, half = box.pose_world_box, 0.5 * box.size
    ends = sections.points[:, capsules].astype(float)
    places = ends[..., :1, :] + np.linspace(0.0, 1.0, 33)[:, None] * (ends[..., 1:, :] - ends[..., :1, :])
    away = np.maximum(np.abs((places - pose[:3, 3]) @ pose[:3, :3]) - half, 0.0)
    return bool((np.linalg.norm(away, axis=-1).min(axis=-1) < sections.radii[:, capsules] - _TOLERANCE_M).any())


def _boxes(sections: Sections) -> tuple[Floats, Floats]:
    """Around each capsule, `(s, c, 3)` each [m]."""
    low = sections.points.min(axis=2) - sections.radii[..., None]
    high = sections.points.max(axis=2) + sections.radii[..., None]
    return low.astype(float), high.astype(float)


class SaysForWhom(Invariant):
    """A robot that waits for cleared space says for which robot, or why nobody clears any; never for itself."""

    name = "says for whom it waits"
    _WITHIN_S = 1.5
    _CALM_S = 0.5

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._since: dict[str, float] = {}
        self._refused: dict[str, dict[str, float]] = defaultdict(dict)
        """By robot, what it was refused for, and when last."""

    @property
    def published(self) -> Handlers:
        return {} if self.facts.cell.separation is None else {RobotState: self._state, Clearance: self._answered}

    def _answered(self, _: str, clearance: Clearance) -> None:
        if clearance.refused is not None:
            self._refused[clearance.robot][clearance.refused.text] = self.facts.now
            if clearance.refused.by == clearance.robot:
                self.broken(clearance.robot, f"it is refused room for itself: {clearance.refused.text}")

    def _state(self, _: str, state: RobotState) -> None:
        robot, facts, said = state.robot, self.facts, state.waiting_for
        shown = facts.shown.get(robot)
        asks = shown is not None and shown.message.way.owned < len(shown.message.way.sections)
        waits = state.mode in (Mode.RUNNING, Mode.RETURNING) and asks and not facts.moving(robot)
        other_cause = said.startswith(("zone ", "the manager")) or said in self._refused[robot]
        if not waits or other_cause or not facts.calm(self._CALM_S):
            self._since.pop(robot, None)
        elif facts.now - self._since.setdefault(robot, facts.now) > self._WITHIN_S:
            what = f"it waits for cleared space, says {said!r}, and was refused: {list(self._refused[robot])[-1:]}"
            self.broken(robot, what)
