"""Where the objects of a node's axes are (CiA 402, CiA 301): each axis has 800h indices of the profile and 64 PDOs.

Axis 1 has 6000h to 67FFh and the PDOs 1 to 64, axis 2 has 6800h to 6FFFh and the PDOs 65 to 128, axis 3 has 7000h to
77FFh and the PDOs 129 to 192.
"""

AXES = 3
"""Most axes of one node."""
AXIS_SPAN = 0x800
"""Indices from an object of one axis to the same object of the next."""
PDO_SPAN = 0x40
"""PDOs from the first of one axis to the first of the next."""
_PROFILE = range(0x6000, 0x6000 + AXIS_SPAN)


def index_of(index: int, axis: int) -> int:
    """The index at which axis 1 to 3 has what axis 1 has at `index`; outside the profile the node has it once."""
    return index + AXIS_SPAN * (axis - 1) if index in _PROFILE else index


def first_axis_index(index: int) -> int:
    """The index at which axis 1 has what any axis has at `index`."""
    for axis in range(1, AXES + 1):
        first = index - AXIS_SPAN * (axis - 1)
        if first in _PROFILE:
            return first
    return index
