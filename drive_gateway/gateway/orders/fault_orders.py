"""Orders to simulated drives to fail: judged, then given over the bus, wherever the drives live."""

from collections.abc import Mapping

from cell.messages.drive_fault import LONGEST_S, NEEDS_VALUE, Fault, FaultDrive
from drive_gateway.canopen.fault_object import (
    DURATION_BYTES,
    DURATION_SUB,
    FAULT_SUBS,
    MARK,
    MARK_SUB,
    fault_index,
)
from drive_gateway.canopen.sdo import Dialogue, SdoRead, SdoWrite
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
            node = self._nodes[order.node_id, order.axis]
            node.sdo.follow(_delivery(node, order, then), asked=True)

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


def _delivery(node: Node, order: FaultDrive, then: Told) -> Dialogue:
    """One order on its way: mark, duration, fault, each after the one before was answered."""
    index = fault_index(order.axis)
    mark = yield SdoRead(index, MARK_SUB)
    if mark.data != MARK and (mark.abort_code is not None or not mark.problem):
        found = f": {mark.problem}" if mark.problem else f":{MARK_SUB:02X} holds {mark.data.hex(' ')}"
        text = f"{node.label} is no simulated drive of this project: {index:04X}h{found}"
        then(False, f"{text}; real drives never fail on command", "")
        return
    problem = mark.problem
    if not problem:
        lasts_ms = 0 if order.seconds is None else max(1, round(1000.0 * order.seconds))
        problem = (yield SdoWrite(index, DURATION_SUB, lasts_ms.to_bytes(DURATION_BYTES, "little"))).problem
    if not problem:
        sub, size = FAULT_SUBS[order.fault]
        value = 1 if order.value is None else order.value
        problem = (yield SdoWrite(index, sub, value.to_bytes(size, "little", signed=value < 0))).problem
    then(not problem, f"{node.label} was not told to fail: {problem}" if problem else _said(order), "")


def _said(order: FaultDrive) -> str:
    value = "" if order.value is None else f" {order.value}"
    if order.fault is Fault.EMERGENCY:
        value = f" {order.value:04X}h"
    lasting = "" if order.seconds is None else f" for {order.seconds:g} s"
    return f"simulated drive {order.node_id}, axis {order.axis}: {order.fault}{value}{lasting}"
