"""The digital inputs of one robot by their names, of its drives (60FDh) and of I/O nodes (6000h)."""

from collections.abc import Mapping, Sequence

from drive_gateway.config.settings import NamedInput
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.io.io_node import IoNode


class NamedInputs:
    """What each shows now.

    Args:
        inputs: of the robot.
        drives: of the robot.
        io_nodes: of the bus, by name.
    """

    def __init__(self, inputs: Sequence[NamedInput], drives: Sequence[Drive], io_nodes: Mapping[str, IoNode]) -> None:
        axes = {drive.axis.name: drive for drive in drives}
        self._places: dict[str, tuple[Drive | IoNode, int]] = {
            item.name: (io_nodes[item.io] if item.io else axes[item.axis], item.bit) for item in inputs
        }

    def place(self, name: str) -> tuple[Drive | IoNode, int] | None:
        """Who has an input, and its bit there; `None`: the robot has no such input."""
        return self._places.get(name)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._places)

    def values(self, now: float) -> dict[str, bool | None]:
        """Which are closed (1); `None` where nobody has measured it lately."""
        return {name: _value(carrier, bit, now) for name, (carrier, bit) in self._places.items()}


def _value(carrier: Drive | IoNode, bit: int, now: float) -> bool | None:
    word = carrier.digital_inputs(now) if carrier.operational else None
    return None if word is None else bool(word >> bit & 1)
