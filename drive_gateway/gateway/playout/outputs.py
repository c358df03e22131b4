"""The digital outputs of one robot: which are on, and the events of blocks that are still to switch them.

An operator may switch them too (`hand_switch`), or force them for a test; afterwards what blocks mean counts again.

An event is executed once, with the sample of its tick, or so much earlier as its output leads. Numbers tell whether it
was: blocks say an event again until its tick is played.
"""

from collections.abc import Sequence

from cell.messages.setpoints import OutputEvent, SetpointBlock
from drive_gateway.config.settings import OutputSettings


class Outputs:
    """All outputs are off at first.

    Args:
        outputs: of the robot, in the order in which its claim names them.
        cycle_s: bus cycle [s]; leads are rounded to whole ones.
    """

    def __init__(self, outputs: Sequence[OutputSettings], cycle_s: float) -> None:
        self.names = tuple(output.name for output in outputs)
        self._meant = 0
        """Bit i: the i-th of `names` is to be on by blocks and by hand."""
        self.forced: dict[str, tuple[bool, str]] = {}
        """Outputs that an operator keeps on or off, and who he is."""
        self.barred = ""
        """Why nothing may be switched on although blocks are played; empty: nothing forbids it."""
        self._settings = {output.name: output for output in outputs}
        self._places = tuple(((output.axis, output.io), output.bit) for output in outputs)
        self._leads = tuple(round(output.lead_s / cycle_s) for output in outputs)
        self._kept = sum(1 << place for place, output in enumerate(outputs) if output.keep)
        self._queue: list[OutputEvent] = []
        self.played = 0
        """Number of the newest event of the present owner whose tick was played: all up to it are executed."""
        self._early: set[int] = set()
        """Events above that, which were executed before their tick."""
        self._stopped: list[tuple[str, str]] = []

    @property
    def on(self) -> int:
        """Bit i: the i-th of `names` is on."""
        on = self._meant
        for name, (value, _) in self.forced.items():
            mask = 1 << self.names.index(name)
            on = on | mask if value else on & ~mask
        return on

    def begin(self) -> None:
        """A new owner counts its events from 1."""
        self._queue = []
        self.played = 0
        self._early.clear()

    def take(self, block: SetpointBlock) -> None:
        """An accepted block: what it says replaces all that was to happen from its first tick on."""
        self._queue = [event for event in self._queue if event.tick < block.first_tick]
        self._queue += block.events

    def play(self, tick: int) -> None:
        """Execute what belongs to the sample of `tick`, which is handed out now."""
        if not self._queue:
            return
        for event in self._queue:
            over = event.number <= self.played or event.number in self._early
            if not over and event.tick - self._leads[event.output] <= tick:
                self._early.add(event.number)
                self._set(event.output, event.value)
        while self._queue and self._queue[0].tick <= tick:
            self.played = max(self.played, self._queue.pop(0).number)
        self._early = {number for number in self._early if number > self.played}

    def stop(self, why: str) -> None:
        """No block is played as its agent means it: forget what was to happen, and leave on only what is to be kept."""
        self._queue = []
        self._drop(~self._kept, why)

    def take_stopped(self) -> list[tuple[str, str]]:
        """The outputs that a stop switched off since the last call, each with what stopped."""
        stopped, self._stopped = self._stopped, []
        return stopped

    def named(self, name: str) -> OutputSettings | None:
        """What the drives file says of an output; `None`: the robot has no such output."""
        return self._settings.get(name)

    def is_on(self, name: str) -> bool:
        """Whether an output of the robot is switched on."""
        return bool(self.on >> self.names.index(name) & 1)

    def switch(self, name: str, on: bool) -> None:
        """Switch an output of the robot by hand; what blocks are still to switch remains."""
        self._set(self.names.index(name), on)

    def force(self, name: str, on: bool, by: str) -> None:
        """Keep an output on or off, whatever blocks say, until it follows them again."""
        self.forced[name] = on, by

    def follow(self, name: str) -> None:
        """An output is again as blocks mean it."""
        self.forced.pop(name, None)

    def word(self, axis: str = "", io: str = "") -> int:
        """What 60FEh:01 of one axis' drive, or 6200h of one I/O node, is to be for this robot."""
        places = enumerate(self._places)
        return sum(1 << bit for place, (where, bit) in places if where == (axis, io) and self.on >> place & 1)

    def shown(self, axis: str = "", io: str = "") -> dict[str, bool]:
        """The outputs of one axis' drive, or of one I/O node, and whether they are on."""
        places = enumerate(self._places)
        return {self.names[place]: bool(self.on >> place & 1) for place, (where, _) in places if where == (axis, io)}

    def lost(self, io: str, why: str) -> None:
        """An I/O node is gone: what is not to be kept there goes off, so that it is off when the node comes back."""
        there = sum(1 << place for place, (where, _) in enumerate(self._places) if where == ("", io))
        self._drop(there & ~self._kept, why)

    def _drop(self, places: int, why: str) -> None:
        """Switch off, those too that are forced on: a stop rules. What is forced off stays so."""
        if not (self._meant or self.forced):
            return
        off = self.on & places
        self._stopped += [(name, why) for place, name in enumerate(self.names) if off >> place & 1]
        self._meant &= ~places
        on = {name for name, (value, _) in self.forced.items() if value and places >> self.names.index(name) & 1}
        self.forced = {name: value for name, value in self.forced.items() if name not in on}

    def _set(self, place: int, on: bool) -> None:
        mask = 1 << place
        self._meant = self._meant | mask if on else self._meant & ~mask
