"""Orders to set an input of a simulated drive or I/O node: given over the bus, wherever the device lives."""

from collections.abc import Mapping

from cell.messages import SimulateInput
from drive_gateway.canopen.fault_object import MARK, MARK_SUB, fault_index
from drive_gateway.canopen.input_object import CLOSE_SUB, OPEN_SUB, inputs_index
from drive_gateway.canopen.sdo import Dialogue, SdoRead, SdoWrite
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
            carrier, bit = place
            carrier.node.sdo.follow(_delivery(carrier, bit, order, then), asked=True)


def _delivery(carrier: Drive | IoNode, bit: int, order: SimulateInput, then: Told) -> Dialogue:
    """One order on its way: the mark is read, then the bit is written."""
    axis = carrier.axis.number if isinstance(carrier, Drive) else 1
    mark = yield SdoRead(fault_index(axis), MARK_SUB)
    if mark.abort_code is None and mark.problem:
        then(False, f"{carrier.label}: {mark.problem}", "")
        return
    if mark.data != MARK:
        what = "is no simulated device of this project; inputs of real ones are what is wired to them"
        then(False, f"{carrier.label} {what}", "")
        return
    told = yield SdoWrite(inputs_index(axis), CLOSE_SUB if order.on else OPEN_SUB, bytes((bit,)))
    name = f"{order.robot}: input {order.input}"
    if told.problem:
        then(False, f"{name} was not set: {carrier.label}: {told.problem}", "")
    else:
        then(True, f"{name} is {'on' if order.on else 'off'} at the simulated {carrier.label}", "")
