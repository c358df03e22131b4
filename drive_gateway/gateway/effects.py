"""What the gateway's shell does for its core, beside the effects of `cell.core` and `Sdo`."""

from dataclasses import dataclass

from cell.core import Effect
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.gateway.reference.encoder_record import EncoderRecord


@dataclass(frozen=True, slots=True)
class Frame(Effect):
    """Send a frame now, in the order of the effects."""

    frame: CanFrame


@dataclass(frozen=True, slots=True)
class TakeBlocks(Effect):
    """Give the set-point blocks that have come by now to the core's `receive`, before its next effect is asked for."""


@dataclass(frozen=True, slots=True)
class StorePosition(Effect):
    """Keep where an axis stands over the end of this process, under `name` (robot.axis)."""

    name: str
    record: EncoderRecord


@dataclass(frozen=True, slots=True)
class Record(Effect):
    """Write the frames of the next `seconds` to `file`; `RecordSaid` with the same `call_id` says how it began."""

    call_id: str
    file: str
    seconds: float


@dataclass(frozen=True, slots=True)
class RecordSaid:
    """A recording began, or why it could not."""

    call_id: str
    ok: bool
    text: str


@dataclass(frozen=True, slots=True)
class DrivesSlow:
    """The drives that this process simulates do not keep up; `text` says how much, `remedy` what to do."""

    text: str
    remedy: str


@dataclass(frozen=True, slots=True)
class RecordEnded:
    """A recording is complete; `text` says which and with how many frames."""

    text: str
