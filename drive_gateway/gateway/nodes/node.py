"""One node as the gateway watches it: bring-up, network state, errors, signs of life.

Its axes are `Drive`s; the one module of an I/O node is an `IoNode`.
"""

from collections.abc import Mapping, Sequence
from typing import Protocol

from cell.core import Effect
from drive_gateway.canopen.emcy import Emergency, Meaning, decode_emergency, emergency_of
from drive_gateway.canopen.nmt import NmtState, decode_heartbeat
from drive_gateway.canopen.sdo import Dialogue, SdoChannel, SdoWrite
from drive_gateway.cia402.preparation import HEARTBEAT_CONSUMER, LIFE_TIME_FACTOR
from drive_gateway.config.settings import GatewaySettings
from drive_gateway.gateway.effects import Frame
from drive_gateway.gateway.nodes.bring_up import BringUp, Phase
from drive_gateway.gateway.nodes.guarding import Guarding
from drive_gateway.gateway.nodes.network_stop import NetworkStop
from drive_gateway.gateway.nodes.program import BootProgram
from drive_gateway.gateway.trouble import AXIS_ERROR, EMERGENCY, Trouble


class AxisOfNode(Protocol):
    """What a node needs to know of each of its axes, or of the one module that an I/O node is, and tells it."""

    label: str
    strange: str

    @property
    def measured(self) -> bool:
        """Its statusword and position have come since the node's start."""

    def started(self, now: float) -> None:
        """The node is operational from now on."""

    def silent_s(self, now: float, tick: int) -> float:
        """How long it has sent no statusword; `tick` is the SYNC that should be answered by now."""

    def lost(self) -> None:
        """The node is not operational any more."""

    def ask_error(self) -> None:
        """Let it read which error its axis has; the answer goes to `Node.axis_error`."""

    def forget(self) -> None:
        """The node is reset: what it said before says nothing any more."""


class Watched(Protocol):
    """What the drives file says of a node beside its configuration."""

    @property
    def guarded(self) -> bool:
        """By node guarding instead of heartbeats."""

    @property
    def emergencies(self) -> Mapping[int, Meaning]:
        """Meaning and remedy of its maker's own emergency codes."""


class Node:
    """Bring-up and supervision of one node. Troubles are kept until its robot takes them with `check`.

    Args:
        node_id: of the node.
        label: of the node, for people.
        watched: its error control.
        settings: of the bus.
        program: what it is asked and told when it is brought up.
    """

    def __init__(
        self,
        node_id: int,
        label: str,
        watched: Watched,
        settings: GatewaySettings,
        program: BootProgram,
    ) -> None:
        self.id = node_id
        self.label = label
        self.sdo = SdoChannel(node_id)
        self.operational = False
        """Brought up, and not lost since."""
        self.emergency: Emergency | None = None
        self._told: set[int] = set()
        """Codes of its emergencies since it was last without an error."""
        self._errors: dict[str, Emergency] = {}
        """Of axes of a node with several, by their labels."""
        self.told_problem = ""
        self._emergencies = watched.emergencies
        self.nmt: NmtState | None = None
        self._axes: list[AxisOfNode] = []
        self._settings = settings
        self._bring_up = BringUp(label, node_id, settings, self.sdo, program)
        self._guarding = Guarding(self.id, settings.heartbeat_producer_s) if watched.guarded else None
        self._heartbeat_at = 0.0
        self.parted = False
        """It was told not to watch the gateway any more."""
        self._lost = False
        self._stop = NetworkStop(self.id)
        self._troubles: list[Trouble] = []

    def attach(self, axis: AxisOfNode) -> None:
        """One of the node's axes, to be told what happens to the node."""
        self._axes.append(axis)

    @property
    def kept(self) -> frozenset[tuple[int, int]]:
        """Objects whose values are the drives file's: index and sub-index."""
        return self._bring_up.kept

    @property
    def phase(self) -> Phase:
        return self._bring_up.phase

    @property
    def lost(self) -> bool:
        """It was operational and is not any more; the robot decides when it may be brought up again."""
        return self._lost

    @property
    def problem(self) -> str:
        """Why it is not operational, for people; empty when it is or when its first attempt goes on."""
        if self._stop.active:
            return f"{self.label} did not stop, so it was stopped by NMT"
        return f"{self.label} was lost" if self._lost else self._bring_up.problem

    # What the node sends

    def on_error_control(self, data: bytes, now: float) -> None:
        """Boot-up or heartbeat."""
        state = decode_heartbeat(data)
        if state is None:
            return
        self.nmt = state
        if state is NmtState.BOOT_UP:
            self._bring_up.booted()
        elif self._guarding is not None and not self._guarding.answered(data[0]):
            # A wrong toggle bit: an answer was lost, or it is an old one; it does not count as a sign of life.
            return
        self._heartbeat_at = now
        if not self.operational or state is NmtState.OPERATIONAL:
            return
        if state is NmtState.BOOT_UP:
            text = f"{self.label} restarted by itself and lost its configuration"
            self._lose("unexpected_boot", text, "check its supply")
        else:
            text = f"{self.label} left Operational, its heartbeat says {state.words}"
            self._lose("left_operational", text, "look for a second master on the bus")

    def on_emergency(self, data: bytes) -> None:
        emergency = decode_emergency(data, self._emergencies)
        if emergency is None:
            return
        if emergency.reset:
            if emergency.gone:
                self.emergency = None
                self._told.clear()
                self._errors.clear()
            return
        if emergency.stops or self.emergency is None or not self.emergency.stops:
            self.emergency = emergency
        if self.operational:
            text = f"{self.label} reports {emergency.code:04X}h: {emergency.meaning}"
            stops, again = emergency.stops, emergency.code in self._told
            self._troubles.append(Trouble(EMERGENCY, text, emergency.remedy, self.id, emergency.code, stops, again))
        self._told.add(emergency.code)
        if len(self._axes) > 1:
            for axis in self._axes:
                axis.ask_error()

    def axis_error(self, label: str, code: int) -> None:
        """An axis of a node with several tells its own error (603Fh), 0: it has none."""
        register = 0 if self.emergency is None else self.emergency.register
        error = emergency_of(code, register, self._emergencies)
        if self.emergency is None or error.reset:
            self._errors.pop(label, None)
            return
        if self._errors.get(label) != error and self.operational:
            text = f"{label} has the error {code:04X}h: {error.meaning}"
            self._troubles.append(Trouble(AXIS_ERROR, text, error.remedy, self.id, code, error.stops))
        self._errors[label] = error

    def emergency_of(self, label: str) -> Emergency | None:
        """What is wrong with an axis: its own error, or the node's emergency as long as nobody says whose it is."""
        return self._errors.get(label) if self._errors else self.emergency

    # What the gateway does

    def step(self, now: float, tick: int) -> list[Effect]:
        """Bring-up, supervision and the next SDO; `tick` is the SYNC whose answers should have come."""
        effects: list[Effect] = []
        if self.operational:
            self._watch(now, tick)
        elif not self._lost:
            before = self._bring_up.phase
            effects = self._bring_up.step(now, self.nmt, all(axis.measured for axis in self._axes))
            if self._bring_up.phase is Phase.OPERATIONAL:
                self.operational = True
                self._heartbeat_at = now
                for axis in self._axes:
                    axis.started(now)
            elif self._bring_up.phase is Phase.RESETTING and before is Phase.WAITING:
                self._forget()
        guard = self._guarding.poll(now) if self._guarding is not None and self._watched else None
        if guard is not None:
            effects = [*effects, Frame(guard)]
        if self._stop.active:
            effects = [*effects, *(Frame(frame) for frame in self._stop.frames(now, self.nmt))]
        request = self.sdo.poll()
        return effects if request is None else [*effects, request]

    def check(self) -> Sequence[Trouble]:
        """The troubles since the last check, oldest first."""
        if not self._troubles:
            return ()
        troubles, self._troubles = self._troubles, []
        return troubles

    def stop(self, now: float, lasts_s: float) -> None:
        """NMT stop, for drives that nothing else stops; they must stand within `lasts_s`."""
        self._stop.begin(now, lasts_s)
        self._leave()

    def part(self) -> None:
        """The gateway ends in order: a node that went on watching it would tell an error (8130h) and stand in a fault.

        The next bring-up writes what it watches again. A node that lacks the object watches nothing.
        """

        self.sdo.follow(self._part(), asked=True)

    def _part(self) -> Dialogue:
        index, sub, size = (LIFE_TIME_FACTOR, 0, 1) if self._guarding is not None else (HEARTBEAT_CONSUMER, 1, 4)
        yield SdoWrite(index, sub, bytes(size))
        self.parted = True

    def may_return(self, now: float, idle: bool) -> bool:
        """It is lost and may be brought up again: now that nothing moves (`idle`), or to see what NMT stop did."""
        return self._lost and (self._stop.over(now) if self._stop.active else idle)

    def take_lacking(self) -> Sequence[str]:
        """What it was found to lack since the last call, each with what that costs."""
        if not self._bring_up.lacking:
            return ()
        found, self._bring_up.lacking = self._bring_up.lacking, []
        return found

    def bring_up_again(self, now: float) -> None:
        """Start over after a loss."""
        self._lost = False
        self._stop.end()
        self._bring_up.restart(now)

    @property
    def _watched(self) -> bool:
        """Its guarding is configured."""
        return self._bring_up.phase in (Phase.STARTING, Phase.OPERATIONAL)

    def _forget(self) -> None:
        """What was known before a reset says nothing about the node after it."""
        if self._guarding is not None:
            self._guarding.restart()
        self.nmt = None
        self.emergency = None
        self._told.clear()
        self._errors.clear()
        for axis in self._axes:
            axis.forget()

    def _watch(self, now: float, tick: int) -> None:
        longest_s, label, strange = 0.0, "", ""
        for axis in self._axes:
            silent_s = axis.silent_s(now, tick)
            if silent_s > longest_s:
                longest_s, label, strange = silent_s, axis.label, axis.strange
        if longest_s > self._settings.tpdo_timeout_s:
            if strange:
                text = f"{label} sent no TPDO that can be used for {longest_s:.3f} s, {strange}"
                self._lose("tpdo_silent", text, "look for another sender of it, and into the drive's manual")
            else:
                self._lose("tpdo_silent", f"{label} sent no TPDO for {longest_s:.3f} s", "check power and wiring")
            return
        silent_s = now - self._heartbeat_at
        if silent_s > self._settings.heartbeat_timeout_s:
            silence = "sent no heartbeat" if self._guarding is None else "did not answer its guarding"
            text = f"{self.label} {silence} for {silent_s:.3f} s"
            self._lose("heartbeat_lost", text, "check power and wiring, or raise heartbeat_timeout_s")

    def _leave(self) -> None:
        self._lost, self.operational = True, False
        self.sdo.forget()
        for axis in self._axes:
            axis.lost()

    def _lose(self, code: str, text: str, remedy: str) -> None:
        self._leave()
        self._troubles.append(Trouble(code, text, remedy, self.id))
