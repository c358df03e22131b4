"""User-defined units of a simulated drive (CiA 402-2): what one of its velocity and acceleration objects is."""

from dataclasses import dataclass


@dataclass(slots=True)
class UserUnits:
    """Of one drive; a maker chooses them, so they are set before it is switched on."""

    velocity: float = 1.0
    """[counts/s] of one unit of 6081h, 6099h, 606Ch, 606Dh, 606Fh, 60B1h and 60FFh."""
    acceleration: float = 1.0
    """[counts/s^2] of one unit of 6083h, 6084h, 6085h and 609Ah."""
    velocity_sign: float = 1.0
    """-1: 60FFh counts against 6064h (607Eh: polarity of velocities and of positions are two bits)."""
