"""Faults that a master orders by an SDO (2020h): they begin with the node's next step, and end by themselves."""

from collections import deque
from collections.abc import Callable, MutableMapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from cell.messages.drive_fault import Fault
from drive_gateway.canopen.fault_object import DURATION_SUB, FAULT_SUBS, FIRST_INDEX
from drive_gateway.sim.nodes.faults import FaultsOnCommand
from drive_gateway.sim.services.abort import Abort, AccessRefused
from drive_gateway.sim.services.dictionary import key_of
from drive_gateway.sim.services.objects import AxisObjects

_OF_NODE = (Fault.DROP_OUT, Fault.LATE_TPDOS)
_DURATION = key_of(FIRST_INDEX, DURATION_SUB)


@dataclass(frozen=True, slots=True)
class _Order:
    axis: int
    fault: Fault
    value: int
    lasts_s: float
    """0: it stays."""


class FaultsOfNode(Protocol):
    """What befalls a node as a whole."""

    def silence(self, silent: bool = True) -> None:
        """Its cable is out."""

    def delay_tpdos(self, late_s: float) -> None:
        """What SYNC asks for is sent too late; 0 ends it."""


class OrderedFaults:
    """The node's answer comes first, so that one that is told to drop out confirms it. No reset ends a fault.

    A fault takes the place of one of the same kind on the same axis that still lasts.

    Args:
        node: what fails.
        axes: the objects of its axes, number 1 first; of an I/O node its own.
        drives: of these axes; none at an I/O node, which only drops out or is late.
    """

    def __init__(self, node: FaultsOfNode, axes: Sequence[AxisObjects], drives: FaultsOnCommand | None = None) -> None:
        self._node = node
        self._drives = drives
        self._ordered: deque[_Order] = deque()
        self._ends: dict[tuple[int, Fault], tuple[float, Callable[[], None]]] = {}
        for axis, objects in enumerate(axes, start=1):
            for fault, (sub, _) in FAULT_SUBS.items():
                if drives is None and fault not in _OF_NODE:
                    continue
                key = key_of(FIRST_INDEX, sub)
                objects.guards[key] = partial(_check, fault, objects.numbers)
                objects.followers[key] = partial(self._take, axis, fault, objects.numbers)

    def step(self, now: float) -> None:
        """What has lasted long enough ends; what was ordered begins."""
        for kind in [kind for kind, (at, _) in self._ends.items() if at <= now]:
            self._end(kind)
        while self._ordered:
            order = self._ordered.popleft()
            kind = order.axis, order.fault
            self._end(kind)
            end = self._begin(order)
            if order.lasts_s > 0.0:
                self._ends[kind] = (now + order.lasts_s, end)

    def _take(self, axis: int, fault: Fault, numbers: MutableMapping[int, int], value: int) -> None:
        self._ordered.append(_Order(axis, fault, value, numbers[_DURATION] / 1000.0))
        numbers[_DURATION] = 0

    def _begin(self, order: _Order) -> Callable[[], None]:
        """Let the fault begin, or end where 0 was written; answers what ends it."""
        if order.fault is Fault.DROP_OUT:
            self._node.silence()
            return lambda: self._node.silence(False)
        if order.fault is Fault.LATE_TPDOS or self._drives is None:
            self._node.delay_tpdos(order.value / 1000.0)
            return lambda: self._node.delay_tpdos(0.0)
        return _begin_at_axis(self._drives, order)

    def _end(self, kind: tuple[int, Fault]) -> None:
        if kind in self._ends:
            self._ends.pop(kind)[1]()


def _check(fault: Fault, numbers: MutableMapping[int, int], value: int) -> None:
    """Nothing jumps by 0 counts; an error is over when the drive is reset, and the end of a fault has no duration."""
    if fault is Fault.ENCODER_JUMP and value == 0:
        raise AccessRefused(Abort.RANGE)
    if numbers[_DURATION] and (fault is Fault.EMERGENCY or value == 0):
        raise AccessRefused(Abort.INCOMPATIBLE)


def _begin_at_axis(node: FaultsOnCommand, order: _Order) -> Callable[[], None]:
    servo, value = node.drives[order.axis - 1].servo, order.value
    match order.fault:
        case Fault.EMERGENCY:
            node.raise_emergency(value, order.axis)
            return lambda: None
        case Fault.ENCODER_JUMP:
            servo.jump(value)
            return lambda: servo.jump(-value)
        case Fault.BLOCKED:
            servo.block(value > 0)
            return lambda: servo.block(False)
        case Fault.HOT_MOTOR:
            servo.heat(value > 0)
            return lambda: servo.heat(False)
        case _:
            servo.stick_brake(value > 0)
            return lambda: servo.stick_brake(False)
