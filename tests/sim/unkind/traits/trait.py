"""What a trait is."""

from collections.abc import Callable
from dataclasses import dataclass

from drive_gateway.sim.nodes.node import SimulatedNode


@dataclass(frozen=True, slots=True)
class Trait:
    """A habit of real drives. `give` changes one node, before it is switched on."""

    name: str
    says: str
    """What the drive does, in a sentence."""
    source: str
    """Where that is known from: a standard with its section, a manual with its chapter, a thread."""
    give: Callable[[SimulatedNode], None]
