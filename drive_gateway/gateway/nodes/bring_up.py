"""How a node becomes operational: reset, boot-up, identity, configuration read back, start confirmed by heartbeat.

Everything has a deadline; a node that fails is tried again slowly, so a drive that is switched on later joins.
"""

from collections import deque
from enum import Enum

from cell.core import Effect
from drive_gateway.canopen.axis_objects import first_axis_index
from drive_gateway.canopen.nmt import NmtCommand, NmtState, nmt_frame
from drive_gateway.canopen.pdo_map import Pdo
from drive_gateway.canopen.sdo import ABSENT, Dialogue, SdoChannel, SdoDone
from drive_gateway.cia402.preparation import HEARTBEAT_PRODUCER
from drive_gateway.config.gateway_objects import CYCLE_PERIOD, said_by
from drive_gateway.config.settings import GatewaySettings
from drive_gateway.gateway.effects import Frame
from drive_gateway.gateway.nodes.program import SYNC_COUNTER, BootProgram, Step

RETRY_S = 2.0
"""Pause before a node that failed is tried again."""

_BUSY = 0x08000022
"""Abort code: not in the present device state; after its start a node may need a moment until it stores anything."""
_PDOS = range(0x1400, 0x1C00)
_MAPPINGS = (*range(0x1600, 0x1800), *range(0x1A00, 0x1C00))


class Phase(Enum):
    WAITING = "waiting for the next attempt"
    RESETTING = "waiting for boot-up"
    CONFIGURING = "being configured"
    STARTING = "being started"
    OPERATIONAL = "operational"


class BringUp:
    """The way of one node to Operational. The node's supervisor feeds it boot-ups, heartbeats and SDO outcomes.

    Args:
        label: of the node, for people.
        node_id: of the node.
        settings: of the bus.
        sdo: the node's requests.
        program: what it is asked and told.
    """

    def __init__(
        self, label: str, node_id: int, settings: GatewaySettings, sdo: SdoChannel, program: BootProgram
    ) -> None:
        self._label = label
        self._node_id = node_id
        self._timeout_s = settings.boot_timeout_s
        self._sdo = sdo
        self._program = program
        self._steps: deque[Step] = deque()
        self._refused: dict[tuple[int, int], str] = {}
        """Abort codes for people of writes that the node refused, by index and sub-index: what it shows decides."""
        self._judged: set[tuple[int, int]] = set()
        """What is read back."""
        self._busy_until = 0.0
        self._deadline = 0.0
        self._now = 0.0
        self._booted = False
        self._found = b""
        self.lacking: list[str] = []
        """What the node was found to lack since this was last emptied, each with what that costs."""
        self.phase = Phase.WAITING
        self.problem = ""
        """Why the newest attempt failed; empty while none has."""

    @property
    def kept(self) -> frozenset[tuple[int, int]]:
        """Index and sub-index of all objects that are written when the node is brought up."""
        steps = [*self._program.steps, *self._program.outputs()]
        return frozenset(step.address for step in steps if step.data is not None)

    def restart(self, now: float) -> None:
        """Begin again, at once."""
        self._sdo.forget()
        self._booted = False
        self.phase = Phase.WAITING
        self._deadline = now

    def booted(self) -> None:
        """The node sent its boot-up; a second one while it is configured: the first was that of its power-on."""
        self._booted = self.phase is not Phase.WAITING or self.problem != ""
        if self.phase is Phase.CONFIGURING:
            self._sdo.forget()
            self._configure()
        elif self.phase is Phase.WAITING and self.problem:
            # It was too slow, or is switched on only now: it is as after a reset, and another one would take as long.
            self._deadline = self._now

    def step(self, now: float, nmt: NmtState | None, measured: bool) -> list[Effect]:
        """Do what is due; `nmt` and `measured` are the node's newest heartbeat and whether its TPDO has come."""
        self._now = now
        match self.phase:
            case Phase.WAITING if now >= self._deadline:
                self._enter(Phase.RESETTING)
                if self._booted:
                    return []
                return [Frame(nmt_frame(NmtCommand.RESET_COMMUNICATION, self._node_id))]
            case Phase.RESETTING if self._booted:
                self._enter(Phase.CONFIGURING)
                self._configure()
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
                f"{self._label} sent no boot-up within {self._timeout_s:g} s after NMT reset: check power, wiring, "
                "bit rate and Node-ID; a node that starts more slowly needs a longer boot_timeout_s"
            )
        if self.phase is Phase.CONFIGURING:
            step = self._steps[0]
            if step.shown is not None and self._found:
                return (
                    f"{self._label} was told {_object(step)} as {step.words(step.shown)} and still shows "
                    f"{step.words(self._found)} after {self._timeout_s:g} s: {self._remedy(step)}"
                )
            return (
                f"{self._label} gave no answer to the {step.where()} within {self._timeout_s:g} s: check the wiring, "
                "or raise boot_timeout_s"
            )
        heard = "no heartbeat" if nmt is None else f"heartbeat says {nmt.words}"
        return f"{self._label} did not start within {self._timeout_s:g} s: {heard}; check heartbeat (1017h) and TPDO1"

    def _fail(self, problem: str) -> None:
        self._sdo.forget()
        self._booted = False
        self.phase = Phase.WAITING
        self.problem = problem
        self._deadline = self._now + RETRY_S

    def _configure(self) -> None:
        self._refused.clear()
        self._busy_until = self._now + self._timeout_s
        self._steps = deque([*self._program.steps, *self._program.outputs()])
        self._judged = {step.judges for step in self._steps if step.shown is not None}
        self._sdo.follow(self._configuration())

    def _configuration(self) -> Dialogue:
        """All requests that change something; each may take as long as the whole start of a node."""
        while self._steps:
            step = self._steps[0]
            if step.needless:
                self._steps.popleft()
                continue
            self._deadline = self._now + self._timeout_s
            while not self._settled(step, (yield step.request)):
                if self.phase is not Phase.CONFIGURING:
                    return

    def _settled(self, step: Step, outcome: SdoDone) -> bool:
        """The node may be asked for what follows; else it is asked for this again, or the attempt has failed."""
        code, self._found = outcome.abort_code, b""
        if step.waived and code in ABSENT:
            self._go_without(step)
            return True
        if code == _BUSY and self._now < self._busy_until:
            return False
        if outcome.problem and not self._passes(step, outcome):
            if code is None:
                self._fail(f"{self._label}, {step.where()}: {outcome.problem}; check wiring, or raise sdo_timeout_s")
            else:
                self._fail(f"{self._label} refused {step.where()}: {outcome.problem}; {self._lack(step, code)}")
            return False
        if not outcome.problem and not step.agrees(outcome.data):
            self._disagrees(step, outcome.data)
            return False
        if step.take is not None:
            step.take(outcome.data)
        self._steps.popleft()
        return True

    def _passes(self, step: Step, outcome: SdoDone) -> bool:
        """A refusal that does not end the attempt: nothing depends on the object, or what it shows will decide."""
        code = outcome.abort_code
        if code is None:
            return False
        if step.asked or (step.optional and code in ABSENT):
            return True
        if code in ABSENT or step.data is None:
            return False
        if step.leave is not None:
            return self._stays(step, step.leave)
        if step.address in self._judged:
            self._refused[step.address] = outcome.problem
            return True
        return False

    def _disagrees(self, step: Step, found: bytes) -> None:
        """The node shows something else than was wanted."""
        wanted, refusal = step.words(step.shown or b""), self._refused.get(step.judges)
        if step.constant:
            self._fail(
                f"{self._label} is another {self._program.kind}: {step.what} ({step.index:04X}h:{step.sub:02X}) is "
                f"{step.words(found)}, the drives file says {wanted}; "
                "connect the right one, or correct the file"
            )
        elif refusal is not None:
            self._fail(
                f"{self._label} keeps {_object(step)} at {step.words(found)}, needed is {wanted} "
                f"({refusal}): {self._remedy(step)}"
            )
        else:
            # A drive may need a moment until it shows what was set; the deadline of the phase bounds the repeats.
            self._found = found

    def _stays(self, step: Step, pdo: Pdo) -> bool:
        """A PDO that cannot be taken off the bus disturbs nobody with the identifier that CiA 301 gives it."""
        value = None if step.present is None else step.present.value
        if value is None or value & 0x3FFFFFFF != pdo.cob_id:
            return False
        self.lacking.append(
            f"{self._label} keeps {pdo.name} ({step.index:04X}h:{step.sub:02X}) on the bus, which is not used: it adds "
            "to the bus load"
        )
        return True

    def _go_without(self, step: Step) -> None:
        """Neither this object nor its other parts are asked for again."""
        while self._steps and self._steps[0].index == step.index:
            self._steps.popleft()
        name, cost = self._program.optional[first_axis_index(step.index)]
        self.lacking.append(f"{self._label} has no {step.index:04X}h ({name}), which the drives file waives: {cost}")

    def _lack(self, step: Step, code: int) -> str:
        """What helps where a node refuses what it must have."""
        kind, index = self._program.kind, first_axis_index(step.index)
        other = f"take a {kind}, or a firmware of it, that has this object"
        if code not in ABSENT:
            return other if step.data is None else self._remedy(step)
        if index in self._program.optional:
            return f'a {kind} that may lack it says so in the drives file, waive: ["{index:04X}"]'
        if step.index == HEARTBEAT_PRODUCER:
            return f"say error_control: guarding, if this {kind} has node guarding (100Ch)"
        if step.index == SYNC_COUNTER:
            return "leave out sync_counter, or take drives that all have this object"
        if step.index in _PDOS:
            return f"leave out of the drives file what this PDO is for, or take a {kind} that has it"
        return other

    def _remedy(self, step: Step) -> str:
        """What helps where a node keeps a value of its own."""
        if step.index in _PDOS:
            named = ", name the PDOs that have this by pdos in the drives file" if step.index in _MAPPINGS else ""
            return f"set it with the maker's tool{named}, or take a {self._program.kind} whose PDOs can be changed"
        if step.index == CYCLE_PERIOD:
            return f"choose a cycle_s that this {self._program.kind} takes, or say its own value under objects"
        key = said_by(*step.judges)
        return f"say a value that this {self._program.kind} takes: {key}" if key else "correct it in the drives file"


def _object(step: Step) -> str:
    return f"{step.index:04X}h:{step.sub:02X} ({step.what})"
