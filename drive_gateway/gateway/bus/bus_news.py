"""What happens to a CAN bus as a whole, and what people can do about it."""

from dataclasses import dataclass

from drive_gateway.config.settings import BusSettings


@dataclass(frozen=True, slots=True)
class BusFailed:
    """Nothing goes over the bus any more; `text` is what was found."""

    text: str


@dataclass(frozen=True, slots=True)
class BusBack:
    """The bus works again."""


@dataclass(frozen=True, slots=True)
class BusDisturbed:
    """The bus works, but frames are lost or meet errors."""

    text: str


@dataclass(frozen=True, slots=True)
class SecondMaster:
    """Somebody else commands the drives, too: SYNC, NMT, set points or the gateway's heartbeat with our identifiers."""

    text: str


@dataclass(frozen=True, slots=True)
class BusTraffic:
    """Bits of all frames that were sent and received since the start, with worst-case stuffing."""

    bits: int


BusNews = BusFailed | BusBack | BusDisturbed | SecondMaster


def name_of(settings: BusSettings) -> str:
    return f"CAN bus {settings.interface}:{settings.channel}"


def remedy_of(settings: BusSettings) -> str:
    """What to do about a bus that cannot be opened, or that fails."""
    if settings.interface == "socketcan":
        return f"see `ip -details link show {settings.channel}`, and bring it up (docs/drives.md, SocketCAN)"
    return "check that the adapter is plugged in, its driver is loaded and the channel is up"
