"""A simulated I/O node (CiA 401): digital inputs in 6000h, outputs in 6200h, and what outputs do without a master.

CiA 401: an output whose bit in 6206h is 1 takes the value of its bit in 6207h when the device fails or is stopped by
NMT, one whose bit is 0 keeps its own. As most couplers do, this one takes a master that it does not hear any more
(1016h, node guarding), and a reset of the communication, for such a failure.
"""

from drive_gateway.canopen.io_map import DIGITAL_INPUTS, DIGITAL_OUTPUTS, ERROR_MODE, ERROR_VALUE
from drive_gateway.sim.nodes.node import NodeServices
from drive_gateway.sim.nodes.ordered_faults import OrderedFaults
from drive_gateway.sim.nodes.ordered_inputs import OrderedInputs
from drive_gateway.sim.services.dictionary import key_of, load_io_dictionary
from drive_gateway.sim.services.emergency import COMMUNICATION_LOST


class SimulatedIoNode(NodeServices):
    """A node with digital inputs and outputs, whose inputs are open at first.

    Args:
        node_id: of the node.
        input_bytes: sub-indices of 6000h, 0 to 8.
        output_bytes: sub-indices of 6200h, 0 to 8.
    """

    def __init__(self, node_id: int, input_bytes: int, output_bytes: int) -> None:
        super().__init__(node_id, load_io_dictionary(input_bytes, output_bytes))
        self._inputs = [0] * input_bytes
        self._output_subs = range(1, output_bytes + 1)
        self._failed: set[int] = set()
        self._ordered = OrderedFaults(self, [self._objects.of_axis(1)])
        OrderedInputs(self._objects.of_axis(1), 8 * input_bytes, self.set_input)
        self._restart()

    @property
    def outputs(self) -> int:
        """Which outputs are on, those of the first byte lowest."""
        numbers = self._objects.numbers
        return sum(numbers[key_of(DIGITAL_OUTPUTS, sub)] << 8 * (sub - 1) for sub in self._output_subs)

    def set_input(self, bit: int, closed: bool) -> None:
        """A digital input opens or closes, counted on from byte to byte."""
        place, mask = bit // 8, 1 << bit % 8
        self._inputs[place] = self._inputs[place] | mask if closed else self._inputs[place] & ~mask
        self._show()

    def raise_emergency(self, code: int) -> None:
        """Play that the node finds an error: EMCY with `code`. `end_emergency` ends it."""
        self._failed.add(code)
        self._emergencies.occur(code)

    def end_emergency(self, code: int) -> None:
        """Play that the cause of an error is gone."""
        self._failed.discard(code)
        self._emergencies.vanish(code)

    def advance(self, now: float) -> None:
        """Inputs and outputs do not move by themselves."""

    def _orders(self, now: float) -> None:
        self._ordered.step(now)

    def _power_on(self) -> None:
        self._show()

    def _booted(self) -> None:
        """Nothing waits for it."""

    def _keep_faults(self) -> None:
        for code in self._failed:
            self._emergencies.occur(code)

    def _disconnect(self, code: int = COMMUNICATION_LOST) -> None:  # noqa: ARG002 - whatever it was that failed
        numbers = self._objects.numbers
        for sub in self._output_subs:
            mode, value = numbers[key_of(ERROR_MODE, sub)], numbers[key_of(ERROR_VALUE, sub)]
            key = key_of(DIGITAL_OUTPUTS, sub)
            numbers[key] = numbers[key] & ~mode | value & mode

    def _show(self) -> None:
        for sub, byte in enumerate(self._inputs, start=1):
            self._objects.numbers[key_of(DIGITAL_INPUTS, sub)] = byte
