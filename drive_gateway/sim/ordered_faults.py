"""Faults that somebody outside orders: they begin at the next step of the drives, and end by themselves."""

from collections import deque
from collections.abc import Callable, Sequence

from cell.messages.drive_fault import Fault, FaultDrive
from drive_gateway.sim.node import SimulatedNode


class OrderedFaults:
    """`order` may be called by any thread, `step` by the one that moves the nodes."""

    def __init__(self, nodes: Sequence[SimulatedNode]) -> None:
        self._nodes = {node.node_id: node for node in nodes}
        self._ordered: deque[FaultDrive] = deque()
        self._ends: list[tuple[float, Callable[[], None]]] = []

    def order(self, fault: FaultDrive) -> None:
        """Take one that `FaultOrders` of the gateway has allowed."""
        self._ordered.append(fault)

    def step(self, now: float) -> None:
        """What was ordered begins; what has lasted long enough ends."""
        due = [end for at, end in self._ends if at <= now]
        self._ends = [(at, end) for at, end in self._ends if at > now]
        for end in due:
            end()
        while self._ordered:
            order = self._ordered.popleft()
            end = _begin(self._nodes[order.node_id], order)
            if order.seconds is not None:
                self._ends.append((now + order.seconds, end))


def _begin(node: SimulatedNode, order: FaultDrive) -> Callable[[], None]:
    """Let the fault begin; answers what ends it."""
    servo, value = node.drives[order.axis - 1].servo, order.value or 0
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
            servo.block(True)
            return lambda: servo.block(False)
        case Fault.HOT_MOTOR:
            servo.heat(True)
            return lambda: servo.heat(False)
        case Fault.STUCK_BRAKE:
            servo.stick_brake(True)
            return lambda: servo.stick_brake(False)
        case Fault.LATE_TPDOS:
            node.delay_tpdos(value / 1000.0)
            return lambda: node.delay_tpdos(0.0)
