"""Inputs of a simulated device that are set by an SDO (2021h), wherever the device lives."""

from collections.abc import Callable
from functools import partial

from drive_gateway.canopen.input_object import CLOSE_SUB, INPUTS_INDEX, OPEN_SUB
from drive_gateway.sim.services.abort import Abort, AccessRefused
from drive_gateway.sim.services.dictionary import key_of
from drive_gateway.sim.services.objects import AxisObjects


class OrderedInputs:
    """Sets an input as soon as it is ordered; a bit that the device has not got is refused.

    Args:
        objects: of the device, or of one axis.
        bits: how many inputs it has.
        set_input: takes the bit and whether it is closed.
    """

    def __init__(self, objects: AxisObjects, bits: int, set_input: Callable[[int, bool], None]) -> None:
        self._bits = bits
        for sub, closed in ((CLOSE_SUB, True), (OPEN_SUB, False)):
            key = key_of(INPUTS_INDEX, sub)
            objects.guards[key] = self._check
            objects.followers[key] = partial(_set, set_input, closed)

    def _check(self, bit: int) -> None:
        if bit >= self._bits:
            raise AccessRefused(Abort.RANGE)


def _set(set_input: Callable[[int, bool], None], closed: bool, bit: int) -> None:
    set_input(bit, closed)
