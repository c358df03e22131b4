"""Errors of `drive_gateway.sim`. All derive from `SimulationError`."""

from drive_gateway.config.settings import BusSettings


class SimulationError(Exception):
    """Root of everything that `drive_gateway.sim` raises."""


class BusNotOpened(SimulationError):
    """python-can cannot open the bus that the simulated drives should sit on."""

    def __init__(self, bus: BusSettings, reason: str) -> None:
        super().__init__(
            f"simulated drives: the bus {bus.interface} {bus.channel} cannot be opened ({reason}); "
            "check interface, channel and options in the bus file"
        )
        self.bus = bus
        self.reason = reason


class BusNotShared(SimulationError):
    """The bus exists only inside one process, so drives alone on it would meet nobody."""

    def __init__(self, bus: BusSettings) -> None:
        super().__init__(
            f"simulated drives: the bus {bus.interface} {bus.channel} lives inside one process; start the gateway with "
            "--simulate instead, or choose a bus that processes share, such as udp_multicast or socketcan (vcan)"
        )
        self.bus = bus
