"""The limit switches of an axis as its drive shows them (60FDh, CiA 402): bit 0 negative, bit 1 positive, 1 is active.

Negative and positive are directions of the drive's own counts. Homing looks for these switches; every other motion
stops at them, and leaves them only in the other direction.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.trouble import Trouble


@dataclass(frozen=True, slots=True)
class LimitSwitch:
    """A switch that is active, or, with `side` 0, the switches of an axis that nobody has heard of lately."""

    node: Drive
    side: int
    """Direction of the counts in which it ends the way: -1 or 1; 0 stands for both."""

    @property
    def text(self) -> str:
        if not self.side:
            return f"{self.node.label}: its limit switches (60FDh) are not heard"
        name, bit = ("negative", 0) if self.side < 0 else ("positive", 1)
        return f"{self.node.label} is at its {name} limit switch (60FDh bit {bit})"

    @property
    def remedy(self) -> str:
        if not self.side:
            return "check the drive's PDOs and wiring"
        smaller = self.side * self.node.axis.counts_per_unit > 0.0
        return f"move it off: cell move {self.node.robot} {self.node.axis.name}={'-' if smaller else ''}DISTANCE --by"

    @property
    def trouble(self) -> Trouble:
        remedy = f"cell reset {self.node.robot}; {self.remedy}"
        return Trouble("limit_switch", self.text, remedy, self.node.axis.node_id)

    def forbids(self, way: float) -> bool:
        """Whether the axis may not go this way, in counts."""
        return not self.side or self.side * way > 0.0


def limit_switches(nodes: Sequence[Drive], now: float) -> Iterator[LimitSwitch]:
    """Every limit switch that ends a motion now; none of silent nodes, which are lost."""
    for node in nodes:
        if node.axis.limit_switches is None or not node.operational:
            continue
        word = node.digital_inputs(now)
        if word is None:
            yield LimitSwitch(node, 0)
            continue
        for bit, side in enumerate((-1, 1)):
            if word >> bit & 1:
                yield LimitSwitch(node, side)
