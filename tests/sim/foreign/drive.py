"""A drive in words of CiA 402 alone, for a node of any stack: a state machine, and an axis that is where it is told.

Nothing of it is taken from the gateway or from the simulated drives: states and words are those of the table of CiA
402-2, "power drive system".
"""

FAULT, SWITCH_ON_DISABLED, READY, SWITCHED_ON, ENABLED, QUICK_STOP = 0x08, 0x40, 0x21, 0x23, 0x27, 0x07
_REMOTE, _VOLTAGE = 1 << 9, 1 << 4

OBJECTS: dict[int, tuple[str, int]] = {
    0x1000: ("U32", 0x00020192),
    0x6007: ("I16", 0),
    0x603F: ("U16", 0),
    0x6040: ("U16", 0),
    0x6041: ("U16", 0),
    0x605A: ("I16", 2),
    0x6060: ("I8", 0),
    0x6061: ("I8", 0),
    0x6064: ("I32", 0),
    0x6065: ("U32", 0),
    0x6066: ("U16", 0),
    0x607A: ("I32", 0),
    0x6085: ("U32", 0),
}
"""Type and value from the factory of what is no record; 60C2h is one, of two UNSIGNED8 and INTEGER8."""


class ForeignDrive:
    """`told` is what the newest process data or SDO said; it acts when `sync` is called."""

    def __init__(self, position: int) -> None:
        self.position = position
        """[counts]"""
        self.state = SWITCH_ON_DISABLED
        self._word = 0

    @property
    def statusword(self) -> int:
        return self.state | _REMOTE | (_VOLTAGE if self.state in (READY, SWITCHED_ON, ENABLED, QUICK_STOP) else 0)

    def fail(self) -> None:
        self.state = FAULT

    def sync(self, controlword: int, target: int) -> None:
        """The set points that came before this SYNC act now."""
        self._obey(controlword)
        if self.state == ENABLED:
            self.position = target

    def _obey(self, word: int) -> None:
        reset = word & 0x80 and not self._word & 0x80
        self._word = word
        if self.state == FAULT:
            self.state = SWITCH_ON_DISABLED if reset else FAULT
        elif not word & 0x02:
            self.state = SWITCH_ON_DISABLED
        elif not word & 0x04:
            self.state = QUICK_STOP if self.state in (ENABLED, QUICK_STOP) else SWITCH_ON_DISABLED
        elif not word & 0x01:
            self.state = SWITCH_ON_DISABLED if self.state == QUICK_STOP else READY
        elif word & 0x08:
            self.state = ENABLED if self.state in (SWITCHED_ON, ENABLED, QUICK_STOP) else self.state
        elif self.state in (READY, SWITCHED_ON, ENABLED):
            self.state = SWITCHED_ON
