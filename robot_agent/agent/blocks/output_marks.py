"""Digital outputs that a program switches in step with its motion: from marks on the path to events of blocks.

A mark is a place on a motion, so whatever delays the robot delays it too. It is passed at the first sample at or after
its tau. Until feedback says that it is executed each block says it anew, at its first sample where the mark was passed
before that. The gateway executes it at the first place that it is told, and once.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from cell.messages import OutputEvent
from cell.messages.setpoints import MOST_EVENTS
from robot_agent.agent.blocks.motion_source import SentBlock
from robot_agent.agent.planning.plans import Planned
from robot_agent.language import Mark, Switch
from robot_agent.trajectory import Motion

_AT_S = 1e-5
"""The robot stands at a mark when it is this much planned time in front of it: a stop there may end a little before."""


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
        self._ticks: dict[int, int] = {}
        """When the gateway will execute what it was told, unless a later block says otherwise, by event numbers."""
        self.done_tick = 0
        """The tick of the newest event of this run that was executed; 0 before."""

    def claimed(self, outputs: tuple[str, ...]) -> None:
        """A new claim on a robot with these outputs: numbers begin anew."""
        self.names, self._said = outputs, 0
        self.drop()

    def drop(self) -> None:
        """The program has ended, or begins: what is not executed never will be."""
        self._before, self._executed = self._said, 0
        self._marks, self._ticks, self.done_tick = {}, {}, 0

    def due(self, marks: Iterable[Mark], tick: int) -> None:
        """Switch at a tick, or as soon as possible after it, wherever the robot is."""
        self._marks |= {mark.number: _Mark(mark, tick=tick) for mark in marks if isinstance(mark, Switch)}

    def postpone(self, since: int, ticks: int) -> None:
        """What was due at rest after the tick `since` is due so many ticks later."""
        for number, mark in self._marks.items():
            if mark.motion is None and mark.tick > since:
                self._marks[number] = replace(mark, tick=mark.tick + ticks)

    @property
    def pending(self) -> bool:
        """Whether something is still to be executed that is due, for a robot at the end of its motion."""
        return bool(self._marks)

    def pending_beside(self, path: Planned) -> bool:
        """Whether something is still to be executed that is due elsewhere than on this motion."""
        return any(mark.motion is not path.motion for mark in self._marks.values())

    def accepted(self, block: SentBlock) -> None:
        """The gateway has accepted a block: its events take the place of those that come after its beginning."""
        earlier = {number: tick for number, tick in self._ticks.items() if tick < block.first_tick}
        self._ticks = {event.number: event.tick for event in block.events} | earlier

    def ahead(self, path: Planned) -> None:
        """The robot is on a motion, and will not go on before it has passed the marks on it."""
        self._marks |= self._on(path)

    def executed(self, newest: int, tick: int) -> None:
        """At a tick all events up to `newest` were executed; others whose ticks were over the gateway had forgotten."""
        self.done_tick = max([self.done_tick, *(at for number, at in self._ticks.items() if number <= newest)])
        self._ticks = {number: at for number, at in self._ticks.items() if number > newest and at > tick}
        if newest - self._before > self._executed:
            self._executed = newest - self._before
            self._marks = {number: mark for number, mark in self._marks.items() if number > self._executed}

    def events(self, block: SentBlock, nominal: int, halted: bool) -> tuple[OutputEvent, ...]:
        """What a block is to switch: in its first `nominal` samples, or where it stands after its end within them.

        These are meant by whoever sends it, a ramp too if it begins there. While the robot is halted nothing is
        switched but what its motion passes.
        """
        events = list[OutputEvent]()
        for number, mark in sorted((self._marks | self._on(block.path)).items()):
            index = mark.index(block, nominal)
            if index is None or (halted and mark.motion is not block.path.motion):
                break
            tick = block.first_tick + index
            output = self.names.index(mark.switch.output)
            events.append(OutputEvent(tick, self._before + number, output, mark.switch.on))
            if len(events) == MOST_EVENTS:  # what is left comes with the next block
                break
        self._said = max([self._said, *(event.number for event in events)])
        return tuple(events)

    def _on(self, planned: Planned) -> dict[int, _Mark]:
        """The marks on a motion that are not executed yet."""
        motion = planned.motion
        return {
            switch.number: _Mark(switch, motion, tau)
            for tau, switch in planned.places
            if isinstance(switch, Switch) and switch.number > self._executed
        }
