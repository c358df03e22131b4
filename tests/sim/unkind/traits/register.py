"""All traits by name; each file of traits has one line."""

from tests.sim.unkind.traits.boot import BOOT
from tests.sim.unkind.traits.emergency import EMERGENCY
from tests.sim.unkind.traits.heartbeat import HEARTBEAT
from tests.sim.unkind.traits.homing import HOMING
from tests.sim.unkind.traits.pdo import PDO
from tests.sim.unkind.traits.sync import SYNC_HABITS
from tests.sim.unkind.traits.trait import Trait
from tests.sim.unkind.traits.units import UNITS
from tests.sim.unkind.traits.values import VALUES

TRAITS: dict[str, Trait] = {
    trait.name: trait
    for traits in (
        BOOT,
        EMERGENCY,
        HEARTBEAT,
        HOMING,
        PDO,
        SYNC_HABITS,
        UNITS,
        VALUES,
    )
    for trait in traits
}
