"""The space of all that a robot has planned, in coarse pieces, by which the manager sees who will block whom."""

from bisect import bisect_right
from collections.abc import Iterable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from cell.messages import PlannedWay, Sections, Stay
from cell.messages.sections import MOST_SECTIONS, MOST_STAYS, NO_PIECE, Pieces
from robot_agent.agent.planning.plans import Planned
from robot_agent.workspace import MotionSections, of_points, with_entry

_PIECE_M = 0.06
"""A piece is as many sections as the end of a capsule that goes the farthest goes in so much, in a motion of up to
`_MOST_PIECES`: in a longer one pieces are longer."""
_MOST_PIECES = MOST_SECTIONS // 2
_AGAIN_S = 1.0


class Outlook:
    """Numbers the plans of one claim, and says in which piece of the newest one a section lies."""

    def __init__(self, robot: str, boot: str) -> None:
        self._robot = robot
        self._boot = boot
        self._owner = 0
        self._known: tuple[object, ...] = ()
        self._way: PlannedWay | None = None
        self._pieces_of: dict[int, list[int]] = {}
        """By section: more than one where a way comes again exactly as it was, round after round."""
        self._at = 0
        """The piece in which the robot was last."""
        self._told_at = -np.inf
        self._number = 0

    def look(self, owner: int, motions: Iterable[Planned], *, more: bool) -> None:
        """What is planned now, under this claim: the motion that runs, and those that come; `more`: not all of it.

        What cannot be told in one message comes later.
        """
        planned = tuple((each, each.sections) for each in motions if each.sections is not None)
        if owner != self._owner:
            self._owner, self._number = owner, 0
        known = (owner, more, *(sections for _, sections in planned))
        if known == self._known:
            return
        if known[:1] + known[2:3] != self._known[:1] + self._known[2:3]:
            self._at = 0  # another motion is the first one
        self._known, self._told_at = known, -np.inf
        self._pieces_of = {}
        if not planned:
            self._way = None
            return
        pieces, stays = Sections(), list[Stay]()
        for motion, sections in planned:
            coarse, which = _coarse(sections)
            if len(pieces) + len(coarse) > MOST_SECTIONS:
                more = True
                break
            which = which + len(pieces)
            for section, piece in zip(sections.sections.ids.tolist(), which.tolist(), strict=True):
                self._pieces_of.setdefault(section, []).append(piece)
            for crossing, entry in with_entry(motion.crossings):
                first, last = sections.span(entry, crossing.leave_tau)
                stays.append(Stay(crossing.zone, int(which[first]), int(which[last])))
            pieces = pieces.joined(coarse)
        self._number += 1
        self._way = PlannedWay(self._robot, self._boot, owner, self._number, more, pieces, _whole(stays))

    def news(self, now: float) -> PlannedWay | None:
        """What is to be told now: a new plan at once, the same one again after a while."""
        if self._way is None or now - self._told_at < _AGAIN_S:
            return None
        self._told_at = now
        return self._way

    @property
    def plan(self) -> int:
        """Number of the newest plan; 0: none."""
        return 0 if self._way is None else self._way.number

    @property
    def ends_in(self) -> frozenset[str]:
        """The exclusive zones in which the newest plan ends, though the program goes on."""
        way = self._way
        if way is None or not way.more:
            return frozenset()
        return frozenset(stay.zone for stay in way.stays if stay.last == len(way.pieces) - 1)

    def follow(self, sections: Sections) -> Pieces:
        """`(s,)`: in which piece of the newest plan each section of the robot's way lies, from where it is on.

        Empty without a plan. Of a section that comes several times it is the piece nearest to the one before.
        """
        if self._way is None:
            return np.empty(0, np.uint32)
        at, pieces = self._at, []
        for section in sections.ids.tolist():
            found = self._pieces_of.get(section)
            if found is not None:
                at = found[0] if len(found) == 1 else min(found, key=lambda piece: abs(piece - at))
            pieces.append(NO_PIECE if found is None else at)
        self._at = next((piece for piece in pieces if piece != NO_PIECE), self._at)
        return np.array(pieces, np.uint32)


def _whole(stays: Iterable[Stay]) -> tuple[Stay, ...]:
    """Those in one zone that no piece lies between are one: it goes on over the end of a motion."""
    whole: list[Stay] = []
    for stay in sorted(stays, key=lambda each: (each.zone, each.first)):
        before = whole[-1] if whole else None
        if before is not None and before.zone == stay.zone and stay.first <= before.last + 1:
            whole[-1] = Stay(stay.zone, before.first, max(before.last, stay.last))
        else:
            whole.append(stay)
    return tuple(sorted(whole, key=lambda stay: stay.first)[:MOST_STAYS])


@lru_cache(maxsize=32)
def _coarse(motion: MotionSections) -> tuple[Sections, NDArray[np.intp]]:
    """Pieces of a motion, each the space of some sections in a row; and the piece of each section."""
    points, radii = motion.sections.points.astype(float), motion.sections.radii.astype(float)
    chords = np.linalg.norm(np.diff(points, axis=0), axis=-1).max(axis=(1, 2)) if len(points) > 1 else np.zeros(0)
    way = np.concatenate([[0.0], chords.cumsum()]).tolist()
    firsts, piece_m = [0], max(_PIECE_M, way[-1] / _MOST_PIECES)
    while (following := max(bisect_right(way, way[firsts[-1]] + piece_m), firsts[-1] + 1)) < len(way):
        firsts.append(following)
    counts = np.diff([*firsts, len(way)])
    which = np.repeat(np.arange(len(firsts)), counts)
    middles = points[np.array(firsts) + counts // 2]
    needed = np.linalg.norm(points - middles[which], axis=-1).max(axis=-1) + radii
    return of_points(middles, np.maximum.reduceat(needed, firsts)), which
