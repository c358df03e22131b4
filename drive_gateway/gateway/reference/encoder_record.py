"""Whether an absolute encoder still shows where its axis is: what was stored at rest against what it shows now."""

from dataclasses import dataclass
from enum import Enum
from hashlib import sha256
from math import degrees

from drive_gateway.config.settings import AxisSettings, EncoderSettings


@dataclass(frozen=True, slots=True)
class EncoderRecord:
    """Where an axis stood when its drive was off and its brake on."""

    turns: int
    """Whole turns of the motor."""
    position: int
    """[counts] within the turn."""
    serial: int | None
    """Of the encoder; `None` when the drive does not tell it."""
    calibration: str
    """Names what the counts mean: gear, direction and offset of the drives file."""
    in_use: bool = False
    """It has had torque since, so that it may be anywhere."""


@dataclass(frozen=True, slots=True)
class EncoderReading:
    """What a drive shows after its start."""

    counts: int
    serial: int | None
    battery_empty: bool


class Verdict(Enum):
    KNOWN = "it is where it was"
    OPERATOR = "an operator must confirm where it is"
    REFERENCE_RUN = "it must home"


def calibration_id(axis: AxisSettings) -> str:
    """Eight hex digits that change with the meaning of the axis' counts."""
    return sha256(f"{axis.counts_per_unit!r} {axis.offset!r}".encode()).hexdigest()[:8]


def record_of(reading: EncoderReading, axis: AxisSettings, encoder: EncoderSettings) -> EncoderRecord:
    turns, position = divmod(axis.wrapped(reading.counts), encoder.counts_per_turn)
    return EncoderRecord(turns, position, reading.serial, calibration_id(axis))


def judge(
    stored: EncoderRecord | None, reading: EncoderReading, axis: AxisSettings, encoder: EncoderSettings
) -> tuple[Verdict, str]:
    """Compare, worst first; the text says what was found. Without a record the encoder is believed."""
    if reading.battery_empty:
        return Verdict.REFERENCE_RUN, "the battery of its encoder was empty"
    if stored is None:
        return Verdict.KNOWN, ""
    if stored.serial != reading.serial:
        return Verdict.REFERENCE_RUN, f"its encoder has serial number {reading.serial}, it was {stored.serial}"
    if stored.calibration != calibration_id(axis):
        return Verdict.OPERATOR, "gear, direction or offset in the drives file are others than when it was switched off"
    deviation = axis.nearest(reading.counts - (stored.turns * encoder.counts_per_turn + stored.position), 0)
    if abs(deviation) <= encoder.window:
        return Verdict.KNOWN, ""
    if stored.in_use:
        found = f"it had torque when it was last heard, and stands {shown(axis, deviation)} beside what is noted of it"
        return Verdict.OPERATOR, found
    turns = round(deviation / encoder.counts_per_turn)
    if turns and abs(deviation - turns * encoder.counts_per_turn) <= encoder.window:
        return Verdict.REFERENCE_RUN, f"its encoder jumped by {turns} whole turns of the motor while it was off"
    return Verdict.OPERATOR, f"it stands {shown(axis, deviation)} beside where it was switched off"


def shown(axis: AxisSettings, counts: int) -> str:
    """A distance for people, in degrees or mm."""
    distance = counts / axis.counts_per_unit
    return f"{1000 * distance:.3g} mm" if axis.linear else f"{degrees(distance):.3g} deg"
