"""The gateway asks its drives, one after the other, for what they tell only when asked (`Gauge`).

It does so by frames of its own beside the SDO dialogues, and gives way to every one of them: a node that is asked for
something else is asked for it in the cycle in which it would be asked anyway, and the reading is aborted before.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from cell.core import Effect
from drive_gateway.canopen.expedited import abort, answer_of, upload
from drive_gateway.canopen.sdo import ABSENT, Sdo
from drive_gateway.config.settings import GatewaySettings
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.drives.gauge import Address
from drive_gateway.gateway.effects import Frame
from drive_gateway.gateway.robots.group import DriveGroup

ROUND_S = 1.0
"""In this time every axis of the bus is asked for one object."""


@dataclass(frozen=True, slots=True)
class _Open:
    """What was asked for and not answered yet."""

    drive: Drive
    address: Address
    until: float
    """The node has this long."""

    @property
    def ended(self) -> Frame:
        """Lets the node forget it."""
        return Frame(abort(self.drive.node.id, *self.address))


class GaugeRound:
    """Never has more than one reading open on its bus."""

    def __init__(self, groups: Iterable[DriveGroup], settings: GatewaySettings) -> None:
        self._turn = [(group, drive) for group in groups for drive in group.nodes]
        self._pause_s = ROUND_S / max(1, len(self._turn))
        self._timeout_s = settings.sdo_timeout_s
        self._due = 0.0
        self._next = 0
        self._open: _Open | None = None

    def step(self, now: float, after: Sequence[Effect]) -> Sequence[Effect]:
        """What goes out in this cycle in front of `after`, the requests of the dialogues among it."""
        if self._open is not None:
            return self._go_on(self._open, now, after)
        if now < self._due:
            return ()
        self._due = now + self._pause_s
        return self._ask(now)

    def take(self, node_id: int, data: bytes, now: float) -> None:
        """A frame of a node's SDO server that answers none of the dialogues."""
        asked = self._open
        if asked is None or asked.drive.node.id != node_id:
            return
        answer = answer_of(data, *asked.address)
        if answer is None:
            return
        self._open, gauge = None, asked.drive.gauge
        if answer.abort_code in ABSENT:
            gauge.lacks(asked.address)
        elif answer.abort_code is not None:
            gauge.missed(asked.address)
        else:
            gauge.take(asked.address, answer.data, now)

    def _go_on(self, asked: _Open, now: float, after: Sequence[Effect]) -> Sequence[Effect]:
        node = asked.drive.node
        if not node.operational:
            self._open = None  # its reset makes it forget
        elif any(isinstance(effect, Sdo) and effect.node_id == node.id for effect in after):
            self._open = None
            return (asked.ended,)
        elif now >= asked.until:
            self._open = None
            asked.drive.gauge.missed(asked.address)
            return (asked.ended,)
        return ()

    def _ask(self, now: float) -> Sequence[Effect]:
        """The next axis that has something to tell, and whose node is asked for nothing else."""
        for _ in self._turn:
            group, drive = self._turn[self._next]
            self._next = (self._next + 1) % len(self._turn)
            # A motion of the drives' own goes by SDO: nothing else keeps its nodes busy then.
            if not drive.operational or not drive.node.sdo.idle or group.setup.busy:
                continue
            address = drive.gauge.take_turn()
            if address is not None:
                self._open = _Open(drive, address, now + self._timeout_s)
                return (Frame(upload(drive.node.id, *address)),)
        return ()
