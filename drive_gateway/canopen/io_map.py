"""What an I/O node (CiA 401) with digital inputs and outputs exchanges with the gateway.

Its first TPDO carries its inputs and its first RPDO its outputs, eight bits to each sub-index, as CiA 401 has them from
the factory. The outputs act with the next SYNC, like set points.
"""

from dataclasses import dataclass

from drive_gateway.canopen.bus_load import frame_bits
from drive_gateway.canopen.pdo_map import Pdo

DIGITAL_INPUTS = 0x6000
"""Read input 8-bit: sub-index 1 to 8 (254 in the standard), lowest input first."""
DIGITAL_OUTPUTS = 0x6200
"""Write output 8-bit."""
ERROR_MODE = 0x6206
"""Bit 1: the output takes the value of 6207h when the node fails or misses its master; 0: it keeps its own."""
ERROR_VALUE = 0x6207
DEVICE_PROFILE = 401
"""Lower half of the device type (1000h)."""
IO_EDS = "cia401_io.eds"
"""In `drive_gateway.sim`: the objects of an I/O node as CiA 401 has them."""
MOST_BYTES = 8
"""What fits into one PDO."""


@dataclass(frozen=True, slots=True)
class IoImage:
    """The PDOs of one I/O node; it has inputs or outputs or both."""

    node_id: int
    inputs: Pdo | None
    outputs: Pdo | None

    @property
    def pdos(self) -> tuple[Pdo, ...]:
        return tuple(pdo for pdo in (self.outputs, self.inputs) if pdo is not None)

    @property
    def bits_per_cycle(self) -> float:
        """On the wire, with worst-case stuffing, when an output changes in every cycle."""
        return sum(frame_bits(pdo.data_bytes) / pdo.every for pdo in self.pdos)

    @property
    def timed_bits_s(self) -> float:
        """Nothing comes beside the cycle."""
        return 0.0


def io_image(node_id: int, input_bytes: int, output_bytes: int, inputs_every: int) -> IoImage:
    """The image of a node; its inputs come with each `inputs_every`-th SYNC (1 to 240)."""
    inputs = Pdo(1, False, node_id, _bytes(DIGITAL_INPUTS, input_bytes), inputs_every) if input_bytes else None
    outputs = Pdo(1, True, node_id, _bytes(DIGITAL_OUTPUTS, output_bytes)) if output_bytes else None
    return IoImage(node_id, inputs, outputs)


def _bytes(index: int, count: int) -> tuple[int, ...]:
    return tuple(index << 16 | sub << 8 | 8 for sub in range(1, count + 1))
