"""Whether one drive knows where its axis is, and what is needed when it does not."""

from dataclasses import replace

from drive_gateway.config.settings import AxisSettings
from drive_gateway.gateway.reference.encoder_record import EncoderReading, EncoderRecord, Verdict, judge, record_of


class Reference:
    """An incremental encoder forgets its place with every start of its node; an absolute one is checked after it.

    Args:
        axis: with the check of its absolute encoder, if there is one.
        stored: where it stood when it was last off, as far as that is known.
    """

    def __init__(self, axis: AxisSettings, stored: EncoderRecord | None) -> None:
        self._axis = axis
        self.stored = stored
        self._serial: int | None = None
        self._battery_empty = False
        self._held: tuple[int, float, bool] | None = None
        self._verdict: Verdict | None = None
        self.why = ""
        """What was found, for people; empty while it is known."""
        self.restarted()

    @property
    def known(self) -> bool:
        """The drive knows where its axis is."""
        return self._verdict is Verdict.KNOWN

    @property
    def judged(self) -> bool:
        """All is known that the drive's start says about its reference."""
        return self._verdict is not None

    @property
    def compares(self) -> bool:
        """There is something to compare with, so the axis must stand first."""
        return self.stored is not None or self._held is not None

    @property
    def remedy(self) -> str:
        """What to do, for people; empty while it is known."""
        match self._verdict:
            case Verdict.REFERENCE_RUN if self._axis.homing is None:
                return "give it a homing in the drives file and home it"
            case Verdict.REFERENCE_RUN:
                return "home it: cell home"
            case Verdict.OPERATOR:
                return "look where it is, then: cell accept"
        return ""

    @property
    def missing(self) -> str:
        """Why it is not known and what to do, for people; empty while it is known."""
        if self.known:
            return ""
        return f"{self.why}; {self.remedy}" if self.judged else "not checked yet"

    def lost(self, counts: int, margin: float, torque: bool) -> None:
        """The node falls silent at `counts`; by itself it stops within `margin` [counts] of them.

        With `torque` it may have moved on, so that a larger deviation is no lost turn of its encoder.
        """
        if self.known and self._axis.absolute is not None:
            self._held = counts, margin, torque

    def restarted(self) -> None:
        """The node starts anew."""
        self.why = ""
        if self._axis.incremental:
            self._verdict, self.why = Verdict.REFERENCE_RUN, "its encoder is incremental"
        else:
            self._verdict = Verdict.KNOWN if self._axis.absolute is None else None

    def hear_serial(self, data: bytes) -> None:
        """The encoder's serial number."""
        self._serial = int.from_bytes(data, "little")

    def hear_status(self, data: bytes) -> None:
        """The encoder's status word."""
        encoder = self._axis.absolute
        self._battery_empty = encoder is not None and bool(int.from_bytes(data, "little") & encoder.battery_mask)

    def judge(self, counts: int) -> None:
        """The axis stands at `counts`: is that where it was?"""
        encoder = self._axis.absolute
        if encoder is None:
            return
        stored, reading = self.stored, self._reading(counts)
        if self._held is not None:
            # It was seen until it fell silent: nearer than any record, but it may have braked since.
            at, margin, torque = self._held
            seen = counts if abs(counts - at) <= margin else at
            serial = self._serial if stored is None else stored.serial
            stored = replace(record_of(EncoderReading(seen, serial, False), self._axis, encoder), in_use=torque)
        self._verdict, self.why = judge(stored, reading, self._axis, encoder)
        if self.known:
            self._held = None

    def accept(self) -> str:
        """An operator says that the axis is where its drive shows it; why that is not enough, else empty."""
        if self._verdict is Verdict.OPERATOR:
            self.found()
            return ""
        return "is referenced already" if self.known else f"{self.why or 'is not measured yet'}; {self.remedy}"

    def found(self) -> None:
        """Referenced: by a reference run, or by an operator's word."""
        self._verdict, self.why, self._held, self._battery_empty = Verdict.KNOWN, "", None, False

    def record(self, counts: int) -> EncoderRecord | None:
        """What must be stored of an axis that stands at `counts`, its brake on; `None`: nothing new."""
        encoder = self._axis.absolute
        if encoder is None or not self.known:
            return None
        now = record_of(self._reading(counts), self._axis, encoder)
        before = self.stored
        if before is not None and replace(before, turns=now.turns, position=now.position) == now:
            moved = (now.turns - before.turns) * encoder.counts_per_turn + now.position - before.position
            if abs(moved) <= encoder.window // 4:
                return None
        self.stored = now
        return now

    def used(self) -> EncoderRecord | None:
        """What must be stored when the axis gets torque; `None`: nothing new."""
        if self.stored is None or self.stored.in_use:
            return None
        self.stored = replace(self.stored, in_use=True)
        return self.stored

    def _reading(self, counts: int) -> EncoderReading:
        return EncoderReading(counts, self._serial, self._battery_empty)
