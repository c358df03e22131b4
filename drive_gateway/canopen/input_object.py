"""The object by which an input of a simulated device is set: 2021h of axis 1 or of an I/O node, 2821h and 3021h beyond.

Like the object of faults it is the maker's own: whoever writes it reads the mark of a simulated device first.
"""

from drive_gateway.canopen.axis_objects import AXIS_SPAN

INPUTS_INDEX = 0x2021
CLOSE_SUB = 1
"""UNSIGNED8: the input of this bit closes."""
OPEN_SUB = 2
"""The same, it opens."""


def inputs_index(axis: int) -> int:
    """Where axis 1 to 3 of a node has the object."""
    return INPUTS_INDEX + AXIS_SPAN * (axis - 1)
