"""How a node becomes operational: reset, boot-up, identity, configuration read back, start confirmed by heartbeat.

Everything has a deadline; a node that fails is tried again slowly, so a drive that is switched on later joins.
"""

from collections import deque
from dataclasses import dataclass
from enum import Enum

from cell.core import Effect
from drive_gateway.canopen.nmt import NmtCommand, NmtState, nmt_frame
from drive_gateway.canopen.pdo_map import pdo_writes
from drive_gateway.canopen.sdo import SdoChannel, SdoDone, abort_text
from drive_gateway.cia402.preparation import preparations
from drive_gateway.config.settings import AxisSettings, GatewaySettings
from drive_gateway.gateway.effects import Frame

RETRY_S = 2.0
"""Pause before a node that failed is tried again."""


class Phase(Enum):
    WAITING = "waiting for the next attempt"
    RESETTING = "waiting for boot-up"
    CONFIGURING = "being configured"
    STARTING = "being started"
    OPERATIONAL = "operational"


@dataclass(frozen=True, slots=True)
class _Step:
    """One SDO request; `shown` is what a read must return, `None` for anything."""

    what: str
    index: int
    sub: int
    data: bytes | None
    shown: bytes | None = None


class BringUp:
    """The way of one node to Operational. The node's supervisor feeds it boot-ups, heartbeats and SDO outcomes."""

    def __init__(self, label: str, axis: AxisSettings, settings: GatewaySettings, sdo: SdoChannel) -> None:
        self._label = label
        self._node_id = axis.node_id
        self._timeout_s = settings.boot_timeout_s
        self._sdo = sdo
        self._program = _program(axis, settings)
        self._steps: deque[_Step] = deque()
        self._deadline = 0.0
        self._now = 0.0
        self._booted = False
        self._found = b""
        self.phase = Phase.WAITING
        self.problem = ""
        """Why the newest attempt failed; empty while none has."""

    @property
    def kept(self) -> frozenset[tuple[int, int]]:
        """Index and sub-index of all objects that are written when the node is brought up."""
        return frozenset((step.index, step.sub) for step in self._program if step.data is not None)

    def restart(self, now: float) -> None:
        """Begin again, at once."""
        self._sdo.forget()
        self.phase = Phase.WAITING
        self._deadline = now

    def booted(self) -> None:
        """The node sent its boot-up."""
        self._booted = True

    def step(self, now: float, nmt: NmtState | None, measured: bool) -> list[Effect]:
        """Do what is due; `nmt` and `measured` are the node's newest heartbeat and whether its TPDO has come."""
        self._now = now
        match self.phase:
            case Phase.WAITING if now >= self._deadline:
                self._booted = False
                self._enter(Phase.RESETTING)
                return [Frame(nmt_frame(NmtCommand.RESET_COMMUNICATION, self._node_id))]
            case Phase.RESETTING if self._booted:
                self._steps = deque(self._program)
                self._enter(Phase.CONFIGURING)
                self._ask()
            case Phase.CONFIGURING if not self._steps:
                self._enter(Phase.STARTING)
                return [Frame(nmt_frame(NmtCommand.START, self._node_id))]
            case Phase.STARTING if nmt is NmtState.OPERATIONAL and measured:
                self.phase = Phase.OPERATIONAL
                self.problem = ""
            case Phase.RESETTING | Phase.CONFIGURING | Phase.STARTING if now > self._deadline:
                self._fail(self._late(nmt))
        return []

    def _enter(self, phase: Phase) -> None:
        self.phase = phase
        self._deadline = self._now + self._timeout_s

    def _late(self, nmt: NmtState | None) -> str:
        if self.phase is Phase.RESETTING:
            return (
                f"{self._label} did not answer within {self._timeout_s} s after NMT reset: "
                "check power, wiring, bit rate and Node-ID"
            )
        if self.phase is Phase.CONFIGURING:
            step = self._steps[0]
            found = f", found {_number(self._found)}" if step.shown is not None and self._found else ""
            return f"{self._label} was not configured within {self._timeout_s} s, last at {_where(step)}{found}"
        heard = "no heartbeat" if nmt is None else f"heartbeat says {nmt.name}"
        return f"{self._label} did not start within {self._timeout_s} s: {heard}; check heartbeat (1017h) and TPDO1"

    def _fail(self, problem: str) -> None:
        self._sdo.forget()
        self.phase = Phase.WAITING
        self.problem = problem
        self._deadline = self._now + RETRY_S

    def _ask(self) -> None:
        step = self._steps[0]
        self._found = b""
        self._sdo.submit(step.index, step.sub, step.data, self._answered)

    def _answered(self, outcome: SdoDone) -> None:
        step = self._steps[0]
        if outcome.problem:
            reason = outcome.problem if outcome.abort_code is None else abort_text(outcome.abort_code)
            self._fail(f"{self._label} refused {_where(step)}: {reason}")
            return
        if step.shown is not None and not _equal(outcome.data, step.shown):
            # A drive may need a moment until it shows what was set; the deadline of the phase bounds the repeats.
            self._ask()
            self._found = outcome.data
            return
        self._steps.popleft()
        if self._steps:
            self._ask()


def _where(step: _Step) -> str:
    kind = "read of" if step.data is None else "write of"
    expected = "" if step.shown is None else f", expected {_number(step.shown)}"
    return f"{kind} {step.index:04X}h:{step.sub:02X} ({step.what}{expected})"


def _equal(found: bytes, expected: bytes) -> bool:
    """Equal as numbers: a node may show a value in another length than it was written in."""
    return len(found) > 0 and _number(found) == _number(expected)


def _number(data: bytes) -> int:
    return int.from_bytes(data, "little")


def _program(axis: AxisSettings, settings: GatewaySettings) -> list[_Step]:
    steps = [_Step("vendor in the identity object", 0x1018, 1, None)]
    for item in preparations(axis, settings):
        steps.append(_Step(item.what, item.write.index, item.write.sub, item.write.data))
        steps.append(_Step(item.what, item.shown_index, item.shown_sub, None, item.write.data))
    steps += [_Step("PDO mapping", write.index, write.sub, write.data) for write in pdo_writes(axis.node_id)]
    return steps
