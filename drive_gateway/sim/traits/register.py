"""All traits by name; each file of traits has one line."""

from drive_gateway.sim.traits.boot import BOOT
from drive_gateway.sim.traits.emergency import EMERGENCY
from drive_gateway.sim.traits.heartbeat import HEARTBEAT
from drive_gateway.sim.traits.homing import HOMING
from drive_gateway.sim.traits.pdo import PDO
from drive_gateway.sim.traits.sync import SYNC_HABITS
from drive_gateway.sim.traits.trait import Trait
from drive_gateway.sim.traits.units import UNITS
from drive_gateway.sim.traits.values import VALUES

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
