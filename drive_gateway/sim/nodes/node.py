"""One simulated node: network states, services and their gating (CiA 301) around its device.

The device is one to three drives (CiA 402), or inputs and outputs (CiA 401, `io_node`).

Nothing here knows a clock: time is what the caller says. A node that produces a heartbeat is not guarded: the two share
an identifier.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import partial
from itertools import zip_longest

from drive_gateway.canopen.cob_id import ERROR_CONTROL, NMT, SDO_FROM_NODE, SDO_TO_NODE, SYNC
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.nmt import NmtCommand, NmtState
from drive_gateway.config.settings import AxisSettings
from drive_gateway.sim.axis.axis_servo import AxisServo
from drive_gateway.sim.drives.digital_outputs import DigitalOutputs
from drive_gateway.sim.drives.drive import Drive
from drive_gateway.sim.nodes.faults import FaultsOnCommand
from drive_gateway.sim.nodes.late_frames import LateFrames
from drive_gateway.sim.nodes.ordered_faults import OrderedFaults
from drive_gateway.sim.nodes.ordered_inputs import OrderedInputs
from drive_gateway.sim.services.dictionary import Dictionary, Entry, key_of, load_dictionary
from drive_gateway.sim.services.emergency import COMMUNICATION_LOST, HEARTBEAT_LOST, PDO_TOO_SHORT, Emergencies
from drive_gateway.sim.services.heartbeat import GuardedLife, HeartbeatConsumer, HeartbeatProducer
from drive_gateway.sim.services.objects import ALL, COMMUNICATION, Objects, save_on_command
from drive_gateway.sim.services.pdo import ReceivePdo, TransmitPdo, receive_pdos, transmit_pdos
from drive_gateway.sim.services.pdo_parameters import PdoParameters
from drive_gateway.sim.services.sdo_server import SdoServer

BOOT_S = 0.02
"""From power-on or reset to the boot-up message."""

_GUARD_TIME = key_of(0x100C)
_LIFE_TIME_FACTOR = key_of(0x100D)
_CONSUMER = key_of(0x1016, 1)
_PRODUCER = key_of(0x1017)
_ERROR_BEHAVIOUR = key_of(0x1029, 1)
_SETPOINT_TIMEOUT = key_of(0x2000)
_DRIVE_INPUTS = 32
"""Bits of 60FDh."""
_STATE_AFTER_LOSS = {0: NmtState.PRE_OPERATIONAL, 2: NmtState.STOPPED}

_Handler = Callable[[bytes, float], list[CanFrame]]


class NodeServices(ABC):
    """What every simulated CANopen node does, whatever device it is.

    `receive` takes every frame of the bus and answers; `step` must be called at least every 10 ms. The node is switched
    on by the first of these calls.

    Args:
        node_id: of the node.
        dictionary: its objects, those of the communication profile among them.
    """

    def __init__(self, node_id: int, dictionary: Dictionary) -> None:
        self.node_id = node_id
        self._objects = Objects(dictionary, self.node_id)
        self._emergencies = Emergencies(self._objects, self.node_id)
        self._consumer = HeartbeatConsumer()
        self._producer = HeartbeatProducer()
        self._guarded = GuardedLife()
        self._sdo = SdoServer(self._objects)
        self._parameters = PdoParameters(self._objects, lambda: self._nmt is NmtState.OPERATIONAL)
        save_on_command(self._objects)
        self._objects.followers[_CONSUMER] = self._watch_master
        self._objects.followers[_PRODUCER] = lambda value: self._producer.configure(value, self._now)
        self._now = 0.0
        self._restart_drive = True
        self._silent = False
        self._late = LateFrames()
        self.boot_s: Callable[[bool], float] = lambda _power_on: BOOT_S
        """From power-on (true) or a reset of its communication to its boot-up message [s]."""
        self._nmt = NmtState.BOOT_UP
        self._receive: list[ReceivePdo] = []
        self._transmit: list[TransmitPdo] = []
        self.handlers: dict[int, _Handler] = {}
        """What the node hears at present, by COB-ID."""

    # What the device is

    @abstractmethod
    def advance(self, now: float) -> None:
        """Let what it drives move up to `now`."""

    @abstractmethod
    def _orders(self, now: float) -> None:
        """Carry out what was ordered of the device itself by SDO."""

    @abstractmethod
    def _power_on(self) -> None:
        """The device has its power-on values; what it drives begins anew."""

    @abstractmethod
    def _booted(self) -> None:
        """After a power-on the device is up."""

    @abstractmethod
    def _keep_faults(self) -> None:
        """A fault outlives a reset of the communication and is told again."""

    @abstractmethod
    def _disconnect(self, code: int = COMMUNICATION_LOST) -> None:
        """The master is gone."""

    # Faults on command

    def silence(self, silent: bool = True) -> None:
        """The bus cable is pulled: the node neither hears nor is heard, its device goes on by itself."""
        self._silent = silent

    def power_cycle(self) -> None:
        """The node's supply fails for a moment: it starts again with power-on values, a brake holds its axis."""
        self._restart_drive = True
        self._restart()

    def delay_tpdos(self, late_s: float) -> None:
        """The node measures as ever and sends what SYNC asks for `late_s` too late; 0 ends it."""
        self._late.late_s = late_s

    def add_object(self, index: int, name: str, value: int, writable: bool = False) -> None:
        """It has one UNSIGNED32 more than its EDS says, which shows `value`; before it is switched on."""
        key = key_of(index)
        self._objects.add(Entry(key, name, "I", True, writable, False, 0, 2**32 - 1, value, False, b""))

    @property
    def nmt(self) -> NmtState:
        """`BOOT_UP` while the node initialises."""
        return self._nmt

    @property
    def now(self) -> float:
        """The time to which it has come [s]."""
        return self._now

    @property
    def emergencies(self) -> Emergencies:
        """Its errors, and what it tells of them."""
        return self._emergencies

    @property
    def objects(self) -> Objects:
        """Its object dictionary."""
        return self._objects

    @property
    def hears_sync(self) -> bool:
        """Its frames bring its axes forward; without them only time does."""
        return self._nmt is NmtState.OPERATIONAL and not self._silent

    # Time and frames

    def receive(self, frame: CanFrame, now: float) -> list[CanFrame]:
        """Take one frame of the bus and return what the node sends because of it."""
        handler = self.handlers.get(frame.id)
        if handler is None or self._silent:
            return []
        self._now = max(self._now, now)
        if frame.remote:
            return self._on_remote(frame.id)
        frames = handler(frame.data, self._now)
        return self._with_emergencies(frames) if self._emergencies.pending else frames

    def step(self, now: float) -> list[CanFrame]:
        """Let time pass: motion, boot-up, heartbeats, timers. Returns what the node sends by itself."""
        self._now = now = max(self._now, now)
        self.advance(now)
        return self.timers()

    def timers(self) -> list[CanFrame]:
        """What the node sends by itself at the time that it has come to."""
        now = self._now
        self._orders(now)
        frames: list[CanFrame] = []
        if self._nmt is NmtState.BOOT_UP:
            frames += self._boot(now)
        else:
            numbers = self._objects.numbers
            if self._consumer.missed(now) or self._guarded.missed(
                numbers[_GUARD_TIME], numbers[_LIFE_TIME_FACTOR], now
            ):
                self._heartbeat_lost()
            if self._producer.due(now):
                frames.append(self._error_control(self._nmt))
            if self._nmt is NmtState.OPERATIONAL:
                frames += [frame for pdo in self._transmit if (frame := pdo.on_time(now)) is not None]
                frames += self._late.due(now)
        frames = self._with_emergencies(frames)
        return [] if self._silent else frames

    # Network management

    def _restart(self) -> None:
        self._nmt = NmtState.BOOT_UP
        self._boot_at: float | None = None
        self.handlers = {}
        self._sdo.reset()
        self._emergencies.reset()
        self._objects.restore(ALL if self._restart_drive else COMMUNICATION)
        if self._restart_drive:
            self._power_on()
        self._keep_faults()
        self._consumer.configure(0)
        self._guarded.restart()
        self._producer.configure(0, self._now)

    def _boot(self, now: float) -> list[CanFrame]:
        if self._boot_at is None:
            self._boot_at = now + self.boot_s(self._restart_drive)
        if now < self._boot_at:
            return []
        if self._restart_drive:
            self._restart_drive = False
            self._booted()
        self._enter(NmtState.PRE_OPERATIONAL)
        return [self._error_control(NmtState.BOOT_UP)]

    def _on_nmt(self, data: bytes, now: float) -> list[CanFrame]:
        if len(data) != 2 or data[1] not in (0, self.node_id):
            return []
        self.advance(now)
        match data[0]:
            case NmtCommand.START:
                self._enter(NmtState.OPERATIONAL)
            case NmtCommand.STOP:
                self._enter(NmtState.STOPPED)
            case NmtCommand.ENTER_PRE_OPERATIONAL:
                self._enter(NmtState.PRE_OPERATIONAL)
            case NmtCommand.RESET_NODE | NmtCommand.RESET_COMMUNICATION:
                self._disconnect()
                self._restart_drive = data[0] == NmtCommand.RESET_NODE
                self._restart()
        return []

    def _enter(self, state: NmtState) -> None:
        """Services follow the state: SDO not in Stopped, PDO in Operational only."""
        if state is self._nmt:
            return
        self._nmt = state
        self.handlers = {NMT: self._on_nmt, ERROR_CONTROL + self.node_id: _unheard}
        self._transmit = []
        self._receive = []
        self._late.forget()
        if state is NmtState.STOPPED:
            self._disconnect()
        else:
            self.handlers[SDO_TO_NODE + self.node_id] = self._on_sdo
        if state is NmtState.OPERATIONAL:
            self._link_pdos()
        self._watch_master(self._objects.numbers[_CONSUMER], restart=False)

    def _link_pdos(self) -> None:
        self._receive = receive_pdos(self._objects)
        self._transmit = transmit_pdos(self._objects)
        for pdo in self._receive:
            self.handlers[pdo.cob_id] = partial(self._on_rpdo, pdo)
        for sending in self._transmit:
            self.handlers.setdefault(sending.cob_id, _unheard)
        self.handlers[SYNC] = self._on_sync

    def _with_emergencies(self, frames: list[CanFrame]) -> list[CanFrame]:
        """Emergencies wait while the node may not send them."""
        if self._nmt not in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL):
            return frames
        pending, self._emergencies.pending = self._emergencies.pending, []
        return frames + pending

    def _error_control(self, state: NmtState) -> CanFrame:
        return CanFrame(ERROR_CONTROL + self.node_id, bytes((state,)))

    # The master's heartbeat

    def _watch_master(self, entry: int, restart: bool = True) -> None:
        if restart:
            self.handlers.pop(ERROR_CONTROL + self._consumer.node_id, None)
            self._consumer.configure(entry)
        if self._consumer.node_id:
            self.handlers[ERROR_CONTROL + self._consumer.node_id] = self._on_heartbeat

    def _on_heartbeat(self, _data: bytes, now: float) -> list[CanFrame]:
        if self._consumer.heard(now):
            self._emergencies.vanish(HEARTBEAT_LOST)
        return []

    def _heartbeat_lost(self) -> None:
        self._emergencies.occur(HEARTBEAT_LOST)
        self._disconnect(HEARTBEAT_LOST)
        after = _STATE_AFTER_LOSS.get(self._objects.numbers[_ERROR_BEHAVIOUR])
        if self._nmt is NmtState.OPERATIONAL and after is not None:
            self._enter(after)

    # Services

    def _on_sdo(self, data: bytes, now: float) -> list[CanFrame]:
        self.advance(now)
        return [CanFrame(SDO_FROM_NODE + self.node_id, answer) for answer in self._sdo.answer(data)]

    def _on_sync(self, _data: bytes, now: float) -> list[CanFrame]:
        """Measure and send first, then take over what was received since the SYNC before."""
        self.advance(now)
        frames = [frame for pdo in self._transmit if (frame := pdo.on_sync()) is not None]
        for pdo in self._receive:
            if pdo.synchronous:
                pdo.take_over()
        return self._late.passed(frames, now)

    def _on_rpdo(self, pdo: ReceivePdo, data: bytes, now: float) -> list[CanFrame]:
        if not pdo.fits(data):
            self._emergencies.occur(PDO_TOO_SHORT)
            return []
        self._emergencies.vanish(PDO_TOO_SHORT)
        pdo.latch(data)
        if not pdo.synchronous:
            self.advance(now)
            pdo.take_over()
        return []

    def _on_remote(self, cob_id: int) -> list[CanFrame]:
        """A remote frame asks for a TPDO, or guards the node if it has no heartbeat."""
        self.advance(self._now)
        if cob_id == ERROR_CONTROL + self.node_id:
            if self._objects.numbers[_PRODUCER]:
                return []
            if self._guarded.lost:
                self._emergencies.vanish(HEARTBEAT_LOST)
            return [CanFrame(cob_id, bytes((self._guarded.polled(self._nmt, self._now),)))]
        return [pdo.frame() for pdo in self._transmit if pdo.cob_id == cob_id and pdo.remote]


class SimulatedNode(NodeServices, FaultsOnCommand):
    """A CANopen node with one to three CiA 402 drives.

    Args:
        axes: of this node, number 1 first and none left out: Node-ID, units and speed.
        starts: [rad or m] where each of them stands at first.
        cycle_s: cycle of the drives' position controllers [s].
        lag_s: lag of an axis behind its set points [s].
        setpoint_timeout: interpolation periods without a set point that are a fault (power-on value of 2000h);
            `None`: as in the EDS.
        servos: the axes behind the drives; `None`, and where none is left: one of the fast level.
    """

    def __init__(
        self,
        axes: Sequence[AxisSettings],
        starts: Sequence[float],
        cycle_s: float,
        lag_s: float,
        setpoint_timeout: int | None = None,
        servos: Sequence[AxisServo | None] = (),
    ) -> None:
        super().__init__(axes[0].node_id, load_dictionary(len(axes)))
        self._setpoint_timeout = setpoint_timeout
        of_axes = [self._objects.of_axis(axis.number) for axis in axes]
        self.outputs = tuple(map(DigitalOutputs, of_axes))
        self._timeouts = [objects.numbers for objects in of_axes]
        self.drives = tuple(
            Drive(axis, start, cycle_s, lag_s, objects, self._emergencies, self._cause_present, servo)
            for axis, start, objects, servo in zip_longest(axes, starts, of_axes, servos)
        )
        self._emergencies.held = lambda code: any(code in drive.faults for drive in self.drives)
        self._ordered = OrderedFaults(self, of_axes, self)
        for drive, objects in zip(self.drives, of_axes, strict=True):
            OrderedInputs(objects, _DRIVE_INPUTS, drive.input)
        self._restart()

    def advance(self, now: float) -> None:
        for drive in self.drives:
            drive.advance(now)

    def _orders(self, now: float) -> None:
        self._ordered.step(now)

    def _power_on(self) -> None:
        if self._setpoint_timeout is not None:
            for numbers in self._timeouts:
                numbers[_SETPOINT_TIMEOUT] = self._setpoint_timeout
        for drive in self.drives:
            drive.reset()

    def _booted(self) -> None:
        for drive in self.drives:
            drive.started()

    def _keep_faults(self) -> None:
        for drive in self.drives:
            for code in drive.faults:
                self._emergencies.occur(code)

    def _disconnect(self, code: int = COMMUNICATION_LOST) -> None:
        for drive, outputs in zip(self.drives, self.outputs, strict=True):
            drive.connection_lost(code)
            outputs.disconnected()

    def _cause_present(self, code: int) -> bool:
        return code == HEARTBEAT_LOST and (self._consumer.lost or self._guarded.lost)


def _unheard(_data: bytes, _now: float) -> list[CanFrame]:
    """Another sender uses this node's TPDO identifier: the data are not for it."""
    return []
