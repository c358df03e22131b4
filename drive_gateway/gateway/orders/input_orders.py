"""Orders to set an input of a simulated drive or I/O node: given over the bus, wherever the device lives."""

from collections.abc import Mapping

from cell.messages import SimulateInput
from drive_gateway.canopen.abort_text import abort_text
from drive_gateway.canopen.fault_object import MARK, MARK_SUB, fault_index
from drive_gateway.canopen.input_object import CLOSE_SUB, OPEN_SUB, inputs_index
from drive_gateway.canopen.sdo import SdoDone
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.io.io_node import IoNode
from drive_gateway.gateway.orders.objects import Told
from drive_gateway.gateway.robots.robot import Robot


class InputOrders:
    """Nothing is written to a node that does not show the mark of a simulated device: it may be real."""

    def __init__(self, robots: Mapping[str, Robot]) -> None:
        self._robots = robots

    def obey(self, order: SimulateInput, then: Told) -> None:
        """Set the input, or say why not; `then` is told when the device has confirmed it."""
        robot = self._robots.get(order.robot)
        if robot is None:
            then(False, f"no robot {order.robot} on this bus; it has {', '.join(self._robots)}", "")
            return
        inputs = robot.group.inputs
        place = inputs.place(order.input)
        if place is None:
            known = ", ".join(inputs.names)
            found = f"its inputs are {known}" if known else "`inputs` of the drives file names none"
            then(False, f"{order.robot} has no input {order.input}; {found}", "")
        else:
            _Delivery(*place, order, then).begin()


class _Delivery:
    """One order on its way: the mark is read, then the bit is written."""

    def __init__(self, carrier: Drive | IoNode, bit: int, order: SimulateInput, then: Told) -> None:
        self._label = carrier.label
        self._sdo = carrier.node.sdo
        self._axis = carrier.axis.number if isinstance(carrier, Drive) else 1
        self._bit = bit
        self._order = order
        self._then = then

    def begin(self) -> None:
        self._sdo.submit(fault_index(self._axis), MARK_SUB, None, self._marked, asked=True)

    def _marked(self, outcome: SdoDone) -> None:
        if outcome.abort_code is None and outcome.problem:
            self._then(False, f"{self._label}: {outcome.problem}", "")
        elif outcome.data != MARK:
            text = (
                f"{self._label} is no simulated device of this project; inputs of real ones are what is wired to them"
            )
            self._then(False, text, "")
        else:
            sub = CLOSE_SUB if self._order.on else OPEN_SUB
            self._sdo.submit(inputs_index(self._axis), sub, bytes((self._bit,)), self._written, asked=True)

    def _written(self, outcome: SdoDone) -> None:
        name = f"{self._order.robot}: input {self._order.input}"
        if outcome.problem:
            reason = outcome.problem if outcome.abort_code is None else abort_text(outcome.abort_code)
            self._then(False, f"{name} was not set: {self._label}: {reason}", "")
        else:
            self._then(True, f"{name} is {'on' if self._order.on else 'off'} at the simulated {self._label}", "")
