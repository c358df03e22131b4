"""What the gateway plays, as the agent knows it: the accepted blocks, spliced, and those whose fate is open."""

import itertools
import math
from collections import deque
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cell.messages import DriveFeedback
from robot_agent.agent.blocks.motion_source import SentBlock
from robot_agent.agent.planning.passed import Span
from robot_agent.agent.planning.plans import Extended, Planned

_KEPT_S = 1.0
"""So long blocks are remembered that were played: longer than a robot may be behind its command."""


class Timeline:
    """The blocks of one claim while the drives are enabled."""

    def __init__(self, standing: SentBlock) -> None:
        self._accepted: deque[SentBlock] = deque([standing])
        self._open: deque[SentBlock] = deque()

    @property
    def newest(self) -> SentBlock:
        """The newest block that the gateway has accepted."""
        return self._accepted[-1]

    @property
    def path_rest_tick(self) -> int:
        """The first tick from which on path time stands in all accepted blocks; many in a row may only repeat that."""
        blocks = reversed(self._accepted)
        later = next(blocks)
        for block in blocks:
            if later.path_segment.rest_index > 0 or block.path_rest_tick > later.first_tick:
                break
            later = block
        return later.path_rest_tick

    @property
    def played_out_tick(self) -> int:
        """The first tick from which on nothing moves that was ever sent, whether it was accepted or not."""
        return max(block.rest_tick for block in (self.newest, *self._open))

    def reach(self) -> tuple[float, float]:
        """The smallest and the largest tau [s] of the newest motion that was played or may be, as far as is known."""
        newest, blocks = self.newest.path, list(self._accepted)
        played = zip(blocks, [follower.first_tick for follower in blocks[1:]], strict=False)
        whole = ((block, block.path_rest_tick) for block in (self.newest, *self._open))
        taus = [
            tau
            for block, until in (*played, *whole)
            if block.path is newest
            for tau in (block.path_state(block.first_tick).tau, block.path_state(until).tau)
        ]
        return min(taus), max(taus)

    def exchange(self, old: Planned, longer: Extended) -> bool:
        """Let all blocks of the newest motion be blocks of the one that extends it, if they lie in what both share."""
        if self.newest.path is not old:
            return False
        lowest, highest = self.reach()
        if lowest - longer.cut_s < longer.first_tau or highest - longer.cut_s > longer.splice_s:
            return False
        self._accepted = deque(_on(longer, block) if block.path is old else block for block in self._accepted)
        self._open = deque(_on(longer, block) if block.path is old else block for block in self._open)
        return True

    def sent(self, block: SentBlock) -> None:
        self._open.append(block)

    def observe(self, feedback: DriveFeedback) -> bool:
        """Settle the fate of blocks by a feedback; true when a newer block was accepted."""
        before = self.newest.sequence
        while self._open and self._open[0].sequence <= feedback.block:
            block = self._open.popleft()
            if block.sequence == feedback.block:
                self._accepted.append(block)
        self._open = deque(block for block in self._open if block.first_tick > feedback.tick)
        kept = math.ceil(_KEPT_S / self.newest.planned.motion.cycle_s)
        while len(self._accepted) > 1 and self._accepted[1].first_tick < feedback.tick - kept:
            self._accepted.popleft()
        return self.newest.sequence != before

    def at(self, tick: int) -> tuple[SentBlock, int]:
        """The block and the sample that is played at a tick."""
        for block in reversed(self._accepted):
            if block.first_tick <= tick:
                return block, block.index(tick)
        return self._accepted[0], 0

    def commanded(self, first_tick: int, last_tick: int) -> NDArray[np.float64]:
        """The joints that are commanded at the ticks from the first to the last one: `(m, n)` [rad or m]."""
        parts, until = list[NDArray[np.float64]](), last_tick
        for block in reversed(self._accepted):
            begin = first_tick if block is self._accepted[0] else max(first_tick, block.first_tick)
            if begin <= until:
                samples = np.arange(begin - block.first_tick, until - block.first_tick + 1)
                parts.append(block.segment.q[samples.clip(0, block.segment.length - 1)])
                until = begin - 1
            if until < first_tick:
                break
        return np.concatenate(parts[::-1])

    def certain(self, tick: int) -> Planned | None:
        """The motion that the robot is on at a tick, if it stays on it whatever becomes of the blocks sent."""
        path = self.at(tick)[0].path
        return path if all(block.path.motion is path.motion for block in (self.newest, *self._open)) else None

    def spans(self, from_tick: int, candidate: SentBlock | None = None) -> list[Span]:
        """All motion from a tick to rest: of the accepted blocks, of those that may still be, and of a candidate."""
        played = [(self.newest, from_tick, self.newest.rest_tick)]
        until = self.newest.first_tick
        for block in itertools.islice(reversed(self._accepted), 1, None):
            if until < from_tick:
                break
            played.append((block, from_tick, until))
            until = block.first_tick
        undecided = self._open if candidate is None else [*self._open, candidate]
        return _spans([*reversed(played), *((block, block.first_tick, block.rest_tick) for block in undecided)])

    def stands(self, from_tick: int, candidate: SentBlock | None = None) -> bool:
        """Whether there is no motion in these spans."""
        newest = self.newest
        if newest.segment.rest_index > 0 and newest.rest_tick > from_tick:
            return False
        return all(span.stands for span in self.spans(from_tick, candidate))


def _on(longer: Extended, block: SentBlock) -> SentBlock:
    path, followed = block.path_segment, block.followed
    path = replace(path, tau=path.tau - longer.cut_s)
    if followed is None:
        return replace(block, planned=longer, segment=path)
    return replace(block, followed=replace(followed, planned=longer, given=replace(followed.given, path=path)))


def _spans(pieces: Iterable[tuple[SentBlock, int, int]]) -> list[Span]:
    """Of blocks, each from one tick to another: one span per motion, in the order in which the motions first appear."""
    planned: dict[int, Planned] = {}
    taus: dict[int, list[float]] = {}
    for block, from_tick, until_tick in pieces:
        motion, tau = id(block.planned.motion), block.segment.tau
        planned[motion] = block.planned
        ends = tau.item(block.index(from_tick)), tau.item(block.index(until_tick))
        taus.setdefault(motion, []).extend(ends)
    return [Span(planned[motion], min(each), max(each)) for motion, each in taus.items()]
