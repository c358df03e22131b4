"""The safety inputs of a robot's drives (60FDh): enable inputs, guard doors, emergency-stop buttons.

They tell the cell what hard-wired circuits do. These circuits stop the robot by themselves; the software supports and
never replaces them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.trouble import Trouble


class InputKind(Enum):
    ENABLE = "enable input"
    DOOR = "guard door"
    ESTOP = "emergency-stop button"


_REMEDY = {
    InputKind.ENABLE: "give the drive its enable input",
    InputKind.DOOR: "close the door",
    InputKind.ESTOP: "release the button when the danger is over",
}


@dataclass(frozen=True, slots=True)
class OpenInput:
    """One input that does not permit motion, or that nobody has heard of lately."""

    kind: InputKind
    node: Drive
    bit: int
    heard: bool

    @property
    def text(self) -> str:
        state = "is open" if self.heard else "is not heard"
        return f"{self.node.label}: {self.kind.value} (60FDh bit {self.bit}) {state}"

    @property
    def remedy(self) -> str:
        return _REMEDY[self.kind] if self.heard else "check the drive's PDOs and wiring"

    @property
    def trouble(self) -> Trouble:
        return Trouble(f"{self.kind.name.lower()}_open", self.text, self.remedy, self.node.axis.node_id)


def open_inputs(nodes: Sequence[Drive], now: float) -> Iterator[OpenInput]:
    """Every configured input that is not closed (1); emergency stops first, of silent nodes none: they are lost."""
    found = [item for node in nodes if node.operational for item in _of(node, now)]
    return iter(sorted(found, key=lambda item: item.kind is not InputKind.ESTOP))


def _of(node: Drive, now: float) -> Iterator[OpenInput]:
    inputs = node.axis.inputs
    if inputs is None:
        return
    word = node.digital_inputs(now)
    bits = [(InputKind.ENABLE, bit) for bit in inputs.enable]
    bits += [(InputKind.DOOR, bit) for bit in inputs.door]
    bits += [(InputKind.ESTOP, bit) for bit in inputs.estop]
    for kind, bit in bits:
        if word is None or not word >> bit & 1:
            yield OpenInput(kind, node, bit, word is not None)
