"""What moves a robot, block by block: what is wanted of it, and what it gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from cell.messages import OutputEvent
from robot_agent.agent.blocks.corrections import Correcting
from robot_agent.agent.planning.plans import Planned
from robot_agent.trajectory import Hold, PathState, RateRequest, Segment
from robot_agent.trajectory.sources import CorrectedBlock, CorrectedSource


@dataclass(frozen=True, slots=True)
class Wishes:
    """What the core wants of the next block."""

    requests: tuple[RateRequest, ...]
    stop: bool
    holds: Callable[[Planned, Segment, int], list[Hold]]
    """The holds on a motion at a sample of a segment: zones that may not be entered, the end of a step."""
    cap_m_s: float | None = None
    """The TCP may not be faster."""
    source: MotionSource | None = None
    """What is to move the robot next, as soon as it can; None: nothing else than before."""
    not_before_tick: int = 0
    """The next motion does not begin earlier (a programmed pause)."""
    on_time: bool = False
    """Nor does it begin later (a common start)."""
    end_tick: int | None = None
    """The motion ends then, if it can."""
    correction: Correcting | None = None
    """How a path is corrected."""


@dataclass(frozen=True, slots=True, eq=False)
class Followed:
    """The planned motion that a corrected block follows, and where on it each of its samples is."""

    planned: Planned
    given: CorrectedBlock
    source: CorrectedSource
    """What gives the next block."""


@dataclass(frozen=True, slots=True, eq=False)
class SentBlock:
    """A block that was sent: its segment begins at `first_tick`."""

    sequence: int
    first_tick: int
    source: MotionSource
    """What gave it, and goes on from it."""
    planned: Planned
    segment: Segment
    followed: Followed | None = None
    """For a corrected block, whose `planned` and `segment` are only its samples."""
    events: tuple[OutputEvent, ...] = ()

    @property
    def path(self) -> Planned:
        """The motion that the program means."""
        return self.planned if self.followed is None else self.followed.planned

    @property
    def path_segment(self) -> Segment:
        """How that motion is gone through."""
        return self.segment if self.followed is None else self.followed.given.path

    @property
    def path_rest_tick(self) -> int:
        """The first tick from which on path time stands."""
        return self.first_tick + self.path_segment.rest_index

    def path_state(self, tick: int) -> PathState:
        """Where on that motion the robot is at a tick."""
        return self.path_segment.state(max(0, tick - self.first_tick))

    @property
    def at_motion_begin(self) -> bool:
        """Whether it ends where that motion begins."""
        return self.path_segment.stop_tau <= 0.0

    @property
    def at_motion_end(self) -> bool:
        """Whether it ends where that motion ends."""
        return self.path_segment.stop_tau >= self.path.motion.duration_s

    def index(self, tick: int) -> int:
        """The sample played at a tick; before the first the first, after the last the last."""
        return min(max(tick - self.first_tick, 0), self.segment.length - 1)

    @property
    def rest_tick(self) -> int:
        """The first tick at which the block is at rest for good."""
        return self.first_tick + self.segment.rest_index


@dataclass(frozen=True, slots=True, eq=False)
class Join:
    """Where the next block joins what is played, and what is wanted of it."""

    base: SentBlock
    """The newest block that the gateway has accepted."""
    tick: int
    """The first tick that a block can still have."""
    path_rest_tick: int
    """The first tick from which on path time stands."""
    ahead_s: float
    """From now to `tick`."""
    sequence: int
    """Of the next block."""
    wishes: Wishes


class MotionSource(Protocol):
    """Whatever moves a robot. It starts from where the accepted block leads, and each of its blocks ends at rest."""

    def begin(self, join: Join) -> bool:
        """Take the robot over from what has given the accepted block; False where it does not, and gives nothing."""

    def resume(self, join: Join) -> None:
        """Go on from a block that it gave itself."""

    def samples(self) -> SentBlock:
        """The next samples, as wished, and the ramp to rest after them."""

    def brake(self) -> SentBlock:
        """The ramp to rest from where it begins or goes on."""
