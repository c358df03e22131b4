"""The CAN bus as python-can opens it, and what to do when it cannot."""

import logging
from typing import Any

import can

from drive_gateway.config.settings import BusSettings
from drive_gateway.errors import GatewayError
from drive_gateway.gateway.bus.bus_news import name_of, remedy_of

# Whoever opens a bus tells its errors with the bus and what to do; the library's own log would tell them twice.
logging.getLogger("can").setLevel(logging.CRITICAL)


class BusError(GatewayError):
    """A bus that cannot be opened or used."""

    def __init__(self, settings: BusSettings, found: str, remedy: str) -> None:
        super().__init__(f"{name_of(settings)}: {found}; {remedy}")
        self.interface = settings.interface
        self.channel = settings.channel
        self.found = found
        self.remedy = remedy


def open_bus(settings: BusSettings) -> can.BusABC:
    """Open the bus that the YAML names. Raises `BusError` with what to do."""
    options: dict[str, Any] = dict(settings.options)
    known = ", ".join(sorted(can.VALID_INTERFACES))
    if settings.interface not in can.VALID_INTERFACES:
        raise BusError(settings, f"python-can has no interface {settings.interface!r}", f"allowed are {known}")
    try:
        return can.Bus(interface=settings.interface, channel=settings.channel, bitrate=settings.bitrate, **options)
    except (ImportError, can.CanInterfaceNotImplementedError) as error:
        raise BusError(settings, f"a package is missing: {error}", "install it beside this program") from error
    except (TypeError, ValueError) as error:
        raise BusError(settings, str(error), "correct the channel, bit rate or options of the bus file") from error
    except (can.CanError, OSError) as error:
        raise BusError(settings, str(error), remedy_of(settings)) from error
    except Exception as error:  # a driver may raise whatever it likes
        raise BusError(settings, f"{type(error).__name__}: {error}", remedy_of(settings)) from error
