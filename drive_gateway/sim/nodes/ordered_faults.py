"""Faults that a master orders by an SDO (2020h): they begin with the node's next step, and end by themselves."""

from collections import deque
from collections.abc import Callable, MutableMapping, Sequence
from dataclasses import dataclass
from functools import partial

from cell.messages.drive_fault import Fault
from drive_gateway.canopen.fault_object import DURATION_SUB, FAULT_SUBS, FIRST_INDEX
from drive_gateway.sim.nodes.faults import FaultsOnCommand
from drive_gateway.sim.services.abort import Abort, AccessRefused
from drive_gateway.sim.services.dictionary import key_of
from drive_gateway.sim.services.objects import AxisObjects

_DURATION = key_of(FIRST_INDEX, DURATION_SUB)


@dataclass(frozen=True, slots=True)
class _Order:
    axis: int
    fault: Fault
    value: int
    lasts_s: float
    """0: it stays."""


class OrderedFaults:
    """The node's answer comes first, so that one that is told to drop out confirms it. No reset ends a fault.

    A fault takes the place of one of the same kind on the same axis that still lasts.

    Args:
        node: what fails.
        axes: the objects of its axes, number 1 first.
    """

    def __init__(self, node: FaultsOnCommand, axes: Sequence[AxisObjects]) -> None:
        self._node = node
        self._ordered: deque[_Order] = deque()
        self._ends: dict[tuple[int, Fault], tuple[float, Callable[[], None]]] = {}
        for axis, objects in enumerate(axes, start=1):
            for fault, (sub, _) in FAULT_SUBS.items():
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
            end = _begin(self._node, order)
            if order.lasts_s > 0.0:
                self._ends[kind] = (now + order.lasts_s, end)

    def _take(self, axis: int, fault: Fault, numbers: MutableMapping[int, int], value: int) -> None:
        self._ordered.append(_Order(axis, fault, value, numbers[_DURATION] / 1000.0))
        numbers[_DURATION] = 0

    def _end(self, kind: tuple[int, Fault]) -> None:
        if kind in self._ends:
            self._ends.pop(kind)[1]()


def _check(fault: Fault, numbers: MutableMapping[int, int], value: int) -> None:
    """Nothing jumps by 0 counts; an error is over when the drive is reset, and the end of a fault has no duration."""
    if fault is Fault.ENCODER_JUMP and value == 0:
        raise AccessRefused(Abort.RANGE)
    if numbers[_DURATION] and (fault is Fault.EMERGENCY or value == 0):
        raise AccessRefused(Abort.INCOMPATIBLE)


def _begin(node: FaultsOnCommand, order: _Order) -> Callable[[], None]:
    """Let the fault begin, or end where 0 was written; answers what ends it."""
    servo, value = node.drives[order.axis - 1].servo, order.value
    match order.fault:
        case Fault.EMERGENCY:
            node.raise_emergency(value, order.axis)
            return lambda: None
        case Fault.DROP_OUT:
            node.silence()
            return lambda: node.silence(False)
        case Fault.ENCODER_JUMP:
            servo.jump(value)
            return lambda: servo.jump(-value)
        case Fault.BLOCKED:
            servo.block(value > 0)
            return lambda: servo.block(False)
        case Fault.HOT_MOTOR:
            servo.heat(value > 0)
            return lambda: servo.heat(False)
        case Fault.STUCK_BRAKE:
            servo.stick_brake(value > 0)
            return lambda: servo.stick_brake(False)
        case Fault.LATE_TPDOS:
            node.delay_tpdos(value / 1000.0)
            return lambda: node.delay_tpdos(0.0)
