"""What the gateways' buses must keep to, each and among each other."""

from collections.abc import Iterator

from cell.commands.checks.readings import Readings
from cell.config.fields import host_and_port
from cell.config.problem import Problem
from drive_gateway.cia402.preparation import interpolation_period


def check_buses(readings: Readings) -> Iterator[Problem]:
    """A bus has one master, and its cycle is one that a drive can be told."""
    masters: dict[tuple[object, ...], str] = {}
    for gateway, document, drives in readings.named.usable_drives():
        entry = readings.cell.gateways.get(gateway)
        host = host_and_port(entry.endpoint)[0] if entry is not None else gateway
        options = tuple(sorted((key, str(value)) for key, value in drives.bus.options.items()))
        other = masters.setdefault((host, drives.bus.interface, drives.bus.channel, options), gateway)
        if other != gateway:
            found = f"{drives.bus.channel!r}, the bus of gateway {other} on the same host"
            yield document.problem(("bus", "channel"), found, f"a bus of its own for gateway {gateway}")
        try:
            interpolation_period(drives.cycle_s)
        except ValueError:
            allowed = "1 to 255 times 1 ms, 0.1 ms, 10 us or 1 us (60C2h)"
            yield document.problem(("cycle_s",), document.found(("cycle_s",)), allowed)
