"""Which faults a gateway lets the drives suffer from that its own process simulates."""

from collections.abc import Collection

from cell.messages.drive_fault import LONGEST_S, NEEDS_VALUE, Fault, FaultDrive

_RANGES = {
    Fault.EMERGENCY: (1, 0xFFFF, "the code of an error"),
    Fault.ENCODER_JUMP: (-(2**31), 2**31 - 1, "counts of the encoder"),
    Fault.LATE_TPDOS: (1, 10_000, "milliseconds"),
}


class FaultOrders:
    """`axes`: Node-ID and number of each axis; `simulated`: the drives live in this process, so they cannot be real."""

    def __init__(self, gateway: str, axes: Collection[tuple[int, int]], simulated: bool) -> None:
        self._gateway = gateway
        self._axes = axes
        self._simulated = simulated

    def judged(self, order: FaultDrive) -> tuple[bool, str]:
        """Whether it may be carried out, and what will happen or why not."""
        problem = self._problem(order)
        if problem:
            return False, problem
        value = "" if order.value is None else f" {order.value}"
        if order.fault is Fault.EMERGENCY:
            value = f" {order.value:04X}h"
        lasting = "" if order.seconds is None else f" for {order.seconds:g} s"
        return True, f"simulated drive {order.node_id}, axis {order.axis}: {order.fault}{value}{lasting}"

    def _problem(self, order: FaultDrive) -> str:
        if not self._simulated:
            return (
                f"gateway {self._gateway} does not simulate its drives, they may be real; only one that was started "
                "with --simulate lets them fail"
            )
        if (order.node_id, order.axis) not in self._axes:
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
