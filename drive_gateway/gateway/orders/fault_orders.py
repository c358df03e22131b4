"""Orders to simulated drives to fail: judged, then given over the bus, wherever the drives live."""

from collections.abc import Mapping

from cell.messages.drive_fault import LONGEST_S, NEEDS_VALUE, Fault, FaultDrive
from drive_gateway.canopen.abort_text import abort_text
from drive_gateway.canopen.fault_object import (
    DURATION_BYTES,
    DURATION_SUB,
    FAULT_SUBS,
    MARK,
    MARK_SUB,
    fault_index,
)
from drive_gateway.canopen.sdo import SdoDone
from drive_gateway.gateway.nodes.node import Node
from drive_gateway.gateway.orders.objects import Told

_RANGES = {
    Fault.EMERGENCY: (1, 0xFFFF, "the code of an error"),
    Fault.ENCODER_JUMP: (-(2**31), 2**31 - 1, "counts of the encoder"),
    Fault.LATE_TPDOS: (1, 10_000, "milliseconds"),
}


class FaultOrders:
    """Nothing is written to a node that does not show the mark of a simulated drive: it may be real.

    `nodes`: by Node-ID and number of each axis.
    """

    def __init__(self, gateway: str, nodes: Mapping[tuple[int, int], Node]) -> None:
        self._gateway = gateway
        self._nodes = nodes

    def obey(self, order: FaultDrive, then: Told) -> None:
        """Order the fault, or say why not; `then` is told what will happen when the drive has confirmed it."""
        problem = self._problem(order)
        if problem:
            then(False, problem, "")
        else:
            _Delivery(self._nodes[order.node_id, order.axis], order, then).begin()

    def _problem(self, order: FaultDrive) -> str:
        if (order.node_id, order.axis) not in self._nodes:
            return f"gateway {self._gateway} has no axis {order.axis} of node {order.node_id}"
        if order.fault in NEEDS_VALUE:
            low, high, what = _RANGES[order.fault]
            if order.value is None or not low <= order.value <= high:
                return f"{order.fault} needs a value, {what}, {low} to {high}; found {order.value}"
        elif order.value is not None:
            return f"{order.fault} takes no value; found {order.value}"
        if order.seconds is not None and order.fault is Fault.EMERGENCY:
            return f"{order.fault} takes no duration: it is over when the drive is reset"
        if order.seconds is not None and not 0.0 < order.seconds <= LONGEST_S:
            return f"a fault lasts above 0 and up to {LONGEST_S:g} s; found {order.seconds:g}"
        return ""


class _Delivery:
    """One order on its way: mark, duration, fault, each after the one before was answered."""

    def __init__(self, node: Node, order: FaultDrive, then: Told) -> None:
        self._node = node
        self._order = order
        self._index = fault_index(order.axis)
        self._then = then

    def begin(self) -> None:
        self._node.sdo.submit(self._index, MARK_SUB, None, self._marked, asked=True)

    def _marked(self, outcome: SdoDone) -> None:
        if outcome.abort_code is not None:
            self._refuse(f"{self._index:04X}h: {abort_text(outcome.abort_code)}")
        elif outcome.problem:
            self._fail(outcome)
        elif outcome.data != MARK:
            self._refuse(f"{self._index:04X}h:{MARK_SUB:02X} holds {outcome.data.hex(' ')}")
        else:
            seconds = self._order.seconds
            lasts_ms = 0 if seconds is None else max(1, round(1000.0 * seconds))
            data = lasts_ms.to_bytes(DURATION_BYTES, "little")
            self._node.sdo.submit(self._index, DURATION_SUB, data, self._timed, asked=True)

    def _timed(self, outcome: SdoDone) -> None:
        if outcome.problem:
            self._fail(outcome)
            return
        sub, size = FAULT_SUBS[self._order.fault]
        value = 1 if self._order.value is None else self._order.value
        data = value.to_bytes(size, "little", signed=value < 0)
        self._node.sdo.submit(self._index, sub, data, self._ordered, asked=True)

    def _ordered(self, outcome: SdoDone) -> None:
        if outcome.problem:
            self._fail(outcome)
        else:
            self._then(True, _said(self._order), "")

    def _refuse(self, found: str) -> None:
        text = f"{self._node.label} is no simulated drive of this project: {found}; real drives never fail on command"
        self._then(False, text, "")

    def _fail(self, outcome: SdoDone) -> None:
        reason = outcome.problem if outcome.abort_code is None else abort_text(outcome.abort_code)
        self._then(False, f"{self._node.label} was not told to fail: {reason}", "")


def _said(order: FaultDrive) -> str:
    value = "" if order.value is None else f" {order.value}"
    if order.fault is Fault.EMERGENCY:
        value = f" {order.value:04X}h"
    lasting = "" if order.seconds is None else f" for {order.seconds:g} s"
    return f"simulated drive {order.node_id}, axis {order.axis}: {order.fault}{value}{lasting}"
