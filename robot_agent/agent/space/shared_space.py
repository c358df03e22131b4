"""The room that a robot shares with others, as its agent sees it: what it uses, what it may enter, what it asks for."""

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from cell.messages import Body, Clearance, ManagerState, Refusal, Sections, Way
from robot_agent.agent.planning.passed import Passed, Piece, Span
from robot_agent.agent.planning.plans import Planned
from robot_agent.agent.space.outlook import Outlook
from robot_agent.agent.space.owned_space import OwnedSpace
from robot_agent.kinematics import Model
from robot_agent.trajectory import Hold
from robot_agent.workspace import FOLLOWING_M, MotionSections, Sweep, of_points, owned_by, part_of, sections_of

_NEAR_S = 2e-9
"""A place so near to the border of two sections is in both."""
_UNANSWERED = "cleared space"
_ROUNDING_M = 1e-4
"""Radii are rounded up with where their capsules are."""
_HEADWAY_S = 0.4
"""In front of the end of what is owned, where another robot is in the way: some twenty sections. With half of it one
stops and goes behind another one that is ten times slower, with twice of it programs last a hundredth longer."""


@dataclass(frozen=True, slots=True, eq=False)
class Use:
    """What a robot uses of the cell's space, and what it asks for."""

    sections: Sections = field(default_factory=Sections)
    """All that it may pass by what was sent."""
    model: Model | None = None
    """Of whose body the sections are."""
    ahead: Sections | None = None
    """Those that come after these, in the order of travel; None: it gives up what it does not use."""
    widen_m: float = 0.0
    """How far it is measured from where it is commanded; infinite where no blocks lead it."""


class SharedSpace:
    """Of one robot in a cell that keeps its robots apart; in another one (`kept_apart` false) all space is free."""

    def __init__(self, robot: str, boot: str, *, kept_apart: bool) -> None:
        self._robot = robot
        self.outlook = Outlook(robot, boot)
        self.look_further = False
        """The manager knows too little of what the robot has planned: its way ends in that of another one."""
        self.kept_apart = kept_apart
        self._owned = OwnedSpace(0, 0)
        self._refusal: Refusal | None = None
        self._way = Sections()
        """What was said last: all that is owned is in there."""
        self._measured: frozenset[int] = frozenset()
        """Of that, where it was measured beside its path, or beside what it owned, since it was last in there."""
        self._wanted: Sections | None = None
        """What a robot that stands wants to grow into."""
        self.beside_path = False
        """The robot is measured farther from its path than its sections have room for."""

    # What is heard

    def claimed(self, owner: int, epoch: int) -> None:
        """The robot is owned under a new claim; `epoch` is the highest of a manager that its gateway knows."""
        if owner != self._owned.owner:
            self._owned = self._owned.claimed(owner, epoch)
            self._way, self._refusal = Sections(), None

    def heard_manager(self, state: ManagerState) -> None:
        """A manager of this epoch lives."""
        self._owned.heard_epoch(state.epoch)

    def heard(self, clearance: Clearance) -> None:
        """Take a clearance, unless it is old or for another robot."""
        if clearance.robot == self._robot and self._owned.take(clearance):
            self._refusal = clearance.refused
            self.look_further = clearance.look_further

    @property
    def epoch(self) -> int:
        """The highest of a manager that is known."""
        return self._owned.epoch

    @property
    def taken(self) -> int:
        """Number of that manager's newest clearance that was taken."""
        return self._owned.taken

    # What may be entered

    def holds_on(self, planned: Planned, beside_m: float) -> list[tuple[str, Hold]]:
        """The stretches of a motion that may not be entered now, neither forwards nor backwards; of no zone.

        `beside_m`: so far a correction may lead the robot beside the motion [m].
        """
        if not self.kept_apart or planned.sections is None:
            return []
        motion = _grown(planned.sections, beside_m)
        closed = np.concatenate([[False], ~self._mine(motion.sections), [False]])
        borders = np.flatnonzero(closed[1:] != closed[:-1]).reshape(-1, 2)
        last, taus = len(closed) - 2, motion.taus
        headway_s = _HEADWAY_S if self._refusal is not None and self._refusal.by else 0.0
        return [
            ("", Hold(float(taus[first]), self.why, np.inf if end == last else float(taus[end]), headway_s))
            for first, end in borders.tolist()
        ]

    @property
    def why(self) -> str:
        """Why there is no more space, for people."""
        return _UNANSWERED if self._refusal is None else self._refusal.text

    def owns(self, sections: Sections) -> bool:
        """Whether all of these may be used."""
        return bool(self._mine(sections).all())

    def room_for(self, sections: Sections) -> bool:
        """Whether a robot that stands may grow into these; where not, they are asked for next."""
        if not self.kept_apart or self.owns(sections):
            self._wanted = None
            return True
        self._wanted = sections
        return False

    def outside(self, path: Sweep) -> str:
        """Why a robot may not go through samples that no plan has cut; empty when it may."""
        if not self.kept_apart or _covering(path.points, path.radii, self._mine_said)[0].all():
            return ""
        return self.why

    # What is used

    def used(self, passed: Passed) -> Sections:
        """The sections of a robot that blocks lead; where it is in none, pieces of its body count as such."""
        if not self.kept_apart or not passed.body.known:
            return Sections()
        if passed.widen_m > FOLLOWING_M:
            return self._beside(passed.body)
        some = Sections()
        for span, piece in zip(passed.spans, passed.pieces, strict=True):
            more = self._passed(span, piece)
            if more is None:
                return _united(some, sections_of(passed.body))
            some = _united(some, more)
        return some

    def contains(self, passed: Passed, sections: Sections) -> bool:
        """Whether what a robot may pass anyway contains these sections."""
        return set(self.used(passed).ids.tolist()).issuperset(sections.ids.tolist())

    def _passed(self, span: Span, piece: Piece) -> Sections | None:
        """The sections that a span lies in; None where it lies in none.

        Where the robot stands it stays in what it owns, as at the end of a way back: a section of the path that it has
        come to may be cleared for another robot by now, in part.
        """
        motion = span.planned.sections
        if motion is not None and span.stands:
            near = motion.sections[_around(motion, span.last_tau)]
            mine = self._mine(near)
            if mine.any():
                return near[np.flatnonzero(mine)[:1]]
        if motion is None or span.stands:
            whole, first, last = piece
            path = whole.part(first, last)
            inside, which = _covering(path.points, path.radii, self._mine_said)
            if inside.all():
                return self._mine_said[which]
        if motion is None:
            return None
        return motion.sections[_stretch(motion, span.first_tau, span.last_tau)]

    def beside_blocks(self, body: Body, standing: Sections) -> Sections:
        """The sections of a robot that no blocks lead: those that it owns, as long as it is measured in there.

        `standing` is where it stands, with room around; of one that moves, empty. One that stands keeps nothing that it
        had by force on its way there, such as all in which its drives could have braked: it is known where that ended.
        """
        if not self.kept_apart or not body.known:
            return Sections()
        grown = body.radii_m + body.growth_m[:, None].astype(float)
        mine = self._mine_said
        if len(standing):
            mine = mine[np.flatnonzero(self._cleared(mine) | _as_large(mine, standing))]
        inside, which = _covering(body.poses.astype(float), grown, mine)
        if inside.all():
            return mine[which]
        return standing if len(standing) else self._beside(body)

    def _cleared(self, mine: Sections) -> NDArray[np.bool_]:
        """Which of the sections that the robot owns it does not have because it was measured there."""
        return np.array([each not in self._measured for each in mine.ids.tolist()], dtype=bool)

    def _beside(self, body: Body) -> Sections:
        """Where a body is, and what the robot had before it was measured beside that."""
        mine = self._mine_said
        return _united(mine[np.flatnonzero(self._cleared(mine))], sections_of(body))

    # What is said

    def way(self, sequence: int, use: Use) -> Way:
        """The way for the presence with this sequence; what is not asked for any more is given up."""
        if not self.kept_apart or use.model is None:
            return Way()
        ahead, self._wanted = use.ahead if self._wanted is None else self._wanted, None
        renounce = ahead is None
        whole = use.sections if ahead is None else _united(use.sections, ahead)
        ids, committed = whole.ids.tolist(), len(use.sections)
        by_force = frozenset(ids[:committed]) - self._owned.ids
        self._measured = (self._measured | by_force) & frozenset(ids) if use.widen_m > FOLLOWING_M else frozenset()
        owned = self._owned.follow(ids, committed, renounce=renounce)
        self._owned.ask(sequence, ids[owned:])
        if owned == len(ids):
            self._refusal = None
        self._way, self.beside_path = whole, FOLLOWING_M < use.widen_m < np.inf
        capsules = range(len(use.model.body))
        links = tuple(owned_by(part_of(use.model, capsule)) for capsule in capsules)
        fixed = tuple(capsule for capsule in capsules if use.model.body[capsule].link == 0)
        return Way(whole, committed, owned, links, fixed, self.outlook.plan, self.outlook.follow(whole))

    def _mine(self, sections: Sections) -> NDArray[np.bool_]:
        """Which of them are owned."""
        mine = self._owned.ids
        return np.array([each in mine for each in sections.ids.tolist()], dtype=bool)

    @property
    def _mine_said(self) -> Sections:
        return self._way[np.flatnonzero(self._mine(self._way))]


def onward(planned: Planned, beside_m: float, from_tau: float, to_tau: float) -> Sections:
    """The sections of a motion from one tau to another [s], in that order; backwards where that one is less.

    `beside_m` as in `SharedSpace.holds_on`.
    """
    if planned.sections is None or planned.motion.duration_s == 0.0:
        return Sections()
    motion = _grown(planned.sections, beside_m)
    stretch = _stretch(motion, min(from_tau, to_tau), max(from_tau, to_tau))
    return motion.sections[stretch if from_tau <= to_tau else stretch[::-1]]


@lru_cache(maxsize=4)
def _grown(motion: MotionSections, by_m: float) -> MotionSections:
    """Sections with room for what leads the robot beside its path."""
    if by_m == 0.0:
        return motion
    sections = motion.sections
    grown = of_points(sections.points.astype(float), sections.radii.astype(float) + by_m)
    return MotionSections(motion.taus, grown, motion.stray)


def _around(motion: MotionSections, tau: float) -> NDArray[np.intp]:
    """The one or two sections that a place is in."""
    return _stretch(motion, tau - _NEAR_S, tau + _NEAR_S)


def _stretch(motion: MotionSections, first_tau: float, last_tau: float) -> NDArray[np.intp]:
    first, last = motion.span(first_tau, last_tau)
    return np.arange(first, last + 1)


def _united(some: Sections, more: Sections) -> Sections:
    """Those, and these of the others that are not among them."""
    known = set(some.ids.tolist())
    new = np.array([k for k, each in enumerate(more.ids.tolist()) if each not in known], dtype=np.intp)
    return some if not len(new) else some.joined(more[new])


def _as_large(sections: Sections, as_one: Sections) -> NDArray[np.bool_]:
    """Which of the sections have capsules as thick as those of one section."""
    c = min(sections.radii.shape[1], as_one.radii.shape[1])
    return np.asarray((np.abs(sections.radii[:, :c] - as_one.radii[:1, :c]) < _ROUNDING_M).all(axis=1))


def _covering(
    points: NDArray[np.float64], radii: NDArray[np.float64], sections: Sections
) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Which poses `(m, c, 2, 3)` with radii `(c,)` or `(m, c)` lie in some section, and the sections that they lie in.

    A capsule lies in another one when the ends of its axis are no farther from the other's ends than the radii differ.
    """
    most = sections.radii.shape[1]
    if not len(sections) or points.shape[1] > most:
        return np.zeros(len(points), dtype=bool), np.zeros(0, dtype=np.intp)
    c = points.shape[1]
    away = points[:, None] - sections.points[None, :, :c].astype(float)
    room = sections.radii[None, :, :c] - np.broadcast_to(radii, points.shape[:2])[:, None]
    square = np.einsum("mscek,mscek->msce", away, away).max(axis=-1)
    inside = ((room >= 0.0) & (square <= room * room)).all(axis=-1)
    return inside.any(axis=1), np.flatnonzero(inside.any(axis=0))
