"""The digital outputs of a simulated drive (60FEh of CiA 402): what is on is set and not masked out.

CiA 402 leaves open what becomes of outputs when the master is gone; 6007h is about the motion. This drive switches them
off, whatever 6007h says, as the simplest drives do: what hangs on them must bear that.
"""

from drive_gateway.sim.services.dictionary import key_of
from drive_gateway.sim.services.objects import AxisObjects

_OUTPUTS = key_of(0x60FE, 1)
_MASK = key_of(0x60FE, 2)


class DigitalOutputs:
    """Those of one axis; after power-on all are off."""

    def __init__(self, objects: AxisObjects) -> None:
        self._numbers = objects.numbers

    @property
    def on(self) -> int:
        """The bits whose output is on."""
        return self._numbers[_OUTPUTS] & self._numbers[_MASK]

    def disconnected(self) -> None:
        """The master is gone."""
        self._numbers[_OUTPUTS] = 0
