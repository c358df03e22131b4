"""Digital outputs that a program switches in step with its motion: from marks on the path to events of blocks.

A mark is a place on a motion, so whatever delays the robot delays it too. It is passed at the first sample at or behind
its tau. Until the tick of that sample is played each block says it anew where it does not come before the block; a mark
that was passed while blocks got lost is said at the first sample of the next one.
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from itertools import dropwhile

import numpy as np

from cell.messages import OutputEvent
from robot_agent.agent.planning import Planned
from robot_agent.agent.timeline import SentBlock
from robot_agent.language import Switch
from robot_agent.trajectory import Motion

_AT_S = 1e-5
"""The robot stands at a mark when it is this much planned time in front of it: a stop there may end a little before."""
_MOST_EVENTS = 100
"""A gateway refuses a block with more; what is left comes with the next one."""


@dataclass(frozen=True, slots=True, eq=False)
class _Mark:
    """A switch, and where it is due: at `tau` [s] of a motion; on no other one, but not before `tick`."""

    switch: Switch
    motion: Motion | None = None
    tau: float = 0.0
    tick: int = 0

    def index(self, block: SentBlock, rows: int) -> int | None:
        """The first of so many samples of a block at which it is passed."""
        if self.motion is block.path.motion:
            segment = block.path_segment
            taus = segment.tau[np.minimum(np.arange(rows), segment.length - 1)]
            passed = np.flatnonzero(taus >= self.tau - _AT_S)
            return int(passed[0]) if len(passed) else None
        index = max(self.tick - block.first_tick, 0)
        return index if index < rows else None


class OutputMarks:
    """The marks of one run of a program that are not executed yet, and what the gateway knows of them."""

    def __init__(self) -> None:
        self.names: tuple[str, ...] = ()
        """The robot's outputs, in the order of its claim."""
        self._said = 0
        """The highest number of an event that was sent under the present claim: no other mark gets it."""
        self._before = 0
        """The highest one of earlier runs."""
        self._executed = 0
        """So many switches of this run."""
        self._marks: dict[int, _Mark] = {}
        """Those in front of the robot on its motion, and those that are due, by the number of the switch."""
        self._queued: tuple[OutputEvent, ...] = ()
        """What the gateway will execute, unless a later block says otherwise."""

    def claimed(self, outputs: tuple[str, ...]) -> None:
        """A new claim on a robot with these outputs: numbers begin anew."""
        self.names, self._said = outputs, 0
        self.drop()

    def drop(self) -> None:
        """The program has ended, or begins: what is not executed never will be."""
        self._before, self._executed = self._said, 0
        self._marks, self._queued = {}, ()

    def interrupted(self) -> None:
        """The robot is stopped: its gateway has forgotten what was to come."""
        self._queued = ()

    def due(self, switches: Iterable[Switch], tick: int) -> None:
        """Switch at a tick, or as soon as possible behind it, wherever the robot is."""
        self._marks |= {switch.number: _Mark(switch, tick=tick) for switch in switches}

    @property
    def due_tick(self) -> int | None:
        """The tick by which all is executed that is due; None while the gateway does not know of all.

        For a robot at the end of its motion, where every mark is due.
        """
        if len(self._queued) < len(self._marks):
            return None
        return self._queued[-1].tick if self._queued else 0

    def accepted(self, block: SentBlock) -> None:
        """The gateway has accepted a block: its events take the place of those that come behind its beginning."""
        again = {event.number for event in block.events}
        earlier = (event for event in self._queued if event.tick < block.first_tick and event.number not in again)
        self._queued = (*earlier, *block.events)
        self._marks |= self._on(block.path)

    def played(self, tick: int) -> None:
        """All up to a tick is executed."""
        done = [event.number - self._before for event in self._queued if event.tick <= tick]
        self._queued = self._queued[len(done) :]
        if done:
            self._executed = done[-1]
            self._marks = {number: mark for number, mark in self._marks.items() if number > self._executed}

    def events(
        self, block: SentBlock, nominal: int, undecided: Collection[SentBlock], halted: bool
    ) -> tuple[OutputEvent, ...]:
        """What a block is to switch: in its first `nominal` samples, or where it stands behind its end within them.

        These are meant by whoever sends it, a ramp too if it begins there. What is executed before the block begins,
        whatever became of the `undecided` ones that were sent, is not said again. While the robot is halted nothing is
        switched but what its motion passes.
        """
        sure, events = self._sure(block, undecided), list[OutputEvent]()
        marks = sorted((self._marks | self._on(block.path)).items())
        for number, mark in dropwhile(lambda each: self._before + each[0] in sure, marks):
            index = mark.index(block, nominal)
            if index is None or (halted and mark.motion is not block.path.motion):
                break
            tick = block.first_tick + index
            output = self.names.index(mark.switch.output)
            events.append(OutputEvent(tick, self._before + number, output, mark.switch.on))
            if len(events) == _MOST_EVENTS:
                break
        self._said = max([self._said, *(event.number for event in events)])
        return tuple(events)

    def _sure(self, block: SentBlock, undecided: Collection[SentBlock]) -> set[int]:
        """The numbers of what is executed before a block begins, whichever of the `undecided` blocks are accepted."""
        sure = {event.number for event in self._queued if event.tick < block.first_tick}
        for other in undecided:
            kept = {event.number for event in self._queued if event.tick < other.first_tick}
            sure &= kept | {event.number for event in other.events if event.tick < block.first_tick}
        return sure

    def _on(self, planned: Planned) -> dict[int, _Mark]:
        """The marks on a motion that are not executed yet."""
        motion = planned.motion
        return {
            switch.number: _Mark(switch, motion, tau)
            for tau, switches in zip(motion.ends.tolist(), planned.switches, strict=False)
            for switch in switches
            if switch.number > self._executed
        }
