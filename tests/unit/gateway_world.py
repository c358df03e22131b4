"""The smallest world around a gateway core: drives that answer byte by byte, on virtual time, one lag of a cycle."""

import struct
from dataclasses import replace

import numpy as np

from cell.config.settings import Times
from cell.core import Answer, Arrived, Ended, Publish, Request
from cell.messages import (
    AxisStatus,
    Call,
    Claim,
    Command,
    DriveFeedback,
    EnableDrives,
    Event,
    GatewayState,
    Heard,
    ManagerState,
    Reply,
    ResetDrives,
    SetpointBlock,
    SetupStatus,
)
from drive_gateway.canopen.abort_text import abort_text
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.sdo import Sdo, SdoDone
from drive_gateway.config.settings import AxisSettings, BusSettings, GatewaySettings, RobotDrives
from drive_gateway.gateway.core import GatewayCore
from drive_gateway.gateway.effects import Frame

CYCLE_S = 0.004
START = 0.5
"""[rad or m] where each axis stands at first."""
TIMES = Times()
STATUSWORDS = {
    AxisStatus.SWITCH_ON_DISABLED: 0x0240,
    AxisStatus.READY_TO_SWITCH_ON: 0x0231,
    AxisStatus.SWITCHED_ON: 0x0233,
    AxisStatus.OPERATION_ENABLED: 0x0237,
    AxisStatus.QUICK_STOP_ACTIVE: 0x0217,
    AxisStatus.FAULT: 0x0218,
}
S = AxisStatus


def axis(name: str, node_id: int, **changes: object) -> AxisSettings:
    settings = AxisSettings(
        name=name,
        node_id=node_id,
        counts_per_unit=200_000.0,
        offset=0.25,
        speed=3.0,
        acceleration=20.0,
        quick_stop=40.0,
        following_window=0.05,
        following_time_s=0.05,
        brake_s=0.04,
    )
    return replace(settings, **changes)


def gateway_settings(axes: tuple[AxisSettings, ...] | None = None, **changes: object) -> GatewaySettings:
    axes = axes or (axis("J1", 1), axis("J2", 2, counts_per_unit=-100_000.0))
    settings = GatewaySettings(
        name="left_bus",
        bus=BusSettings("virtual", "left", 1_000_000, {}),
        cycle_s=CYCLE_S,
        overrun_limit_s=0.02,
        heartbeat_producer_s=0.05,
        heartbeat_timeout_s=0.2,
        tpdo_timeout_s=0.05,
        boot_timeout_s=0.5,
        robots={"left": RobotDrives("left", axes)},
    )
    return replace(settings, **changes)


class FakeDrive:
    """A drive that does what it is told one cycle later; `stuck` keeps it where it is, `alive` is its supply.

    `local`: somebody else commands it.
    """

    def __init__(self, settings: AxisSettings, gateway: GatewaySettings) -> None:
        self.id = settings.node_id
        self.gateway = gateway
        self.alive = True
        self.quiet_tpdo = False
        self.stuck = False
        self.local = False
        self.deaf_to_outputs = False
        self.cause_present = False
        self.objects: dict[tuple[int, int], bytes] = {(0x1018, 1): b"\x01\0\0\0"}
        self.writes: list[tuple[int, int, bytes]] = []
        self.refuse: dict[tuple[int, int], int] = {}
        self.status = S.SWITCH_ON_DISABLED
        self.statuses = [self.status]
        self.nmt = 0x7F
        self.controlword = 0
        self.target = self.position = round((START - settings.offset) * settings.counts_per_unit)
        self.heartbeat_due = 0.0

    def take(self, frame: CanFrame) -> list[CanFrame]:
        if not self.alive:
            return []
        if frame.id == 0x000 and frame.data[1] in (0, self.id):
            return self._manage(frame.data[0])
        if frame.id == 0x200 + self.id and self.nmt == 5:
            word, self.target = struct.unpack("<Hi", frame.data)
            if not self.local:
                self._obey(word)
            self.objects[0x607A, 0] = struct.pack("<i", self.target)
        if frame.id == 0x400 + self.id and self.nmt == 5 and not self.deaf_to_outputs:
            self.objects[0x60FE, 1] = frame.data
        if frame.id == 0x600 + self.id and frame.data[0] == 0x40:
            return self._upload(frame.data)
        if frame.id == 0x080 and self.nmt == 5:
            if self.status is S.OPERATION_ENABLED and not self.stuck:
                self.position = self.target
            if not self.quiet_tpdo:
                word = STATUSWORDS[self.status] & (0xFDFF if self.local else 0xFFFF)
                return [CanFrame(0x180 + self.id, struct.pack("<Hi", word, self.position))]
        return []

    def beat(self, now: float) -> list[CanFrame]:
        if not self.alive or now < self.heartbeat_due:
            return []
        self.heartbeat_due = now + self.gateway.heartbeat_producer_s
        return [CanFrame(0x700 + self.id, bytes([self.nmt]))]

    def _upload(self, asked: bytes) -> list[CanFrame]:
        """A short object that the gateway reads by a frame of its own, and at most that."""
        done = self.sdo(Sdo("", self.id, int.from_bytes(asked[1:3], "little"), asked[3], None))
        if done.abort_code is not None:
            return [CanFrame(0x580 + self.id, b"\x80" + asked[1:4] + done.abort_code.to_bytes(4, "little"))]
        head = 0x43 | (4 - len(done.data)) << 2
        return [CanFrame(0x580 + self.id, bytes([head]) + asked[1:4] + done.data.ljust(4, b"\0"))]

    def sdo(self, request: Sdo) -> SdoDone:
        key = (request.index, request.sub)
        if not self.alive:
            return SdoDone(request.request_id, b"", None, "no SDO response received")
        if key in self.refuse:
            return SdoDone(request.request_id, b"", self.refuse[key], abort_text(self.refuse[key]))
        if request.data is None:
            key = (0x6060, 0) if key == (0x6061, 0) else key
            if key not in self.objects:
                return SdoDone(request.request_id, b"", 0x06020000, abort_text(0x06020000))
            return SdoDone(request.request_id, self.objects[key])
        self.objects[key] = request.data
        self.writes.append((*key, request.data))
        return SdoDone(request.request_id, b"")

    def fail(self, code: int) -> list[CanFrame]:
        self.status = S.FAULT
        self.cause_present = True
        return [CanFrame(0x080 + self.id, struct.pack("<HB5x", code, 0x21))]

    def _manage(self, command: int) -> list[CanFrame]:
        if command == 0x82:
            self.nmt = 0x7F
            self.status = S.SWITCH_ON_DISABLED
            return [CanFrame(0x700 + self.id, b"\0")]
        self.nmt = {0x01: 0x05, 0x02: 0x04, 0x80: 0x7F}[command]
        self.heartbeat_due = 0.0
        return []

    def _obey(self, word: int) -> None:
        edge = word & 0x80 and not self.controlword & 0x80
        self.controlword = word
        if self.status is S.FAULT:
            if edge and not self.cause_present:
                self.status = S.SWITCH_ON_DISABLED
        else:
            self.status = self._next(word)
        if self.statuses[-1] is not self.status:
            self.statuses.append(self.status)

    def _next(self, word: int) -> AxisStatus:
        if not word & 0x02:
            return S.SWITCH_ON_DISABLED
        if not word & 0x04:
            stays = (S.OPERATION_ENABLED, S.QUICK_STOP_ACTIVE)
            return S.QUICK_STOP_ACTIVE if self.status in stays else S.SWITCH_ON_DISABLED
        ladder = [S.SWITCH_ON_DISABLED, S.READY_TO_SWITCH_ON, S.SWITCHED_ON, S.OPERATION_ENABLED]
        wanted = {6: 1, 7: 2, 15: 3}[word & 0x0F]
        if self.status not in ladder:
            return self.status
        present = ladder.index(self.status)
        return ladder[present + 1] if wanted > present else ladder[wanted]


def echo_for(command: Command, state: GatewayState | None, feedback: DriveFeedback | None) -> Heard | None:
    """What a caller has seen: the owner's feedback, or the operator's state of the gateway."""
    seen = feedback if isinstance(command, EnableDrives | ResetDrives) else state
    return None if seen is None else Heard(seen.boot, seen.sequence)


class KindManager:
    """A manager that lets the first robot in that a gateway wants to set up, and says that all others stand."""

    def __init__(self, digest: str = "d") -> None:
        self.digest = digest
        self.free = True
        self.sequence = 0

    def answer(self, state: GatewayState, now: float) -> Arrived:
        """Its next state, in view of one of a gateway."""
        self.sequence += 1
        setup = SetupStatus(state.setup[0], self.free, "" if self.free else "right moves") if state.setup else None
        heard = {state.gateway: Heard(state.boot, state.sequence)}
        answer = ManagerState("c", "m", 1, self.sequence, now, self.digest, setup=setup, heard_gateways=heard)
        return Arrived(answer, now)


class World:
    """A core and its drives; `cycle` runs one bus cycle, everything that was said is kept."""

    def __init__(self, settings: GatewaySettings | None = None, **core: object) -> None:
        self.settings = settings or gateway_settings()
        self.core = GatewayCore(self.settings, TIMES, boot="g1", digest="d", first_owner=100, **core)
        self.drives = {a.node_id: FakeDrive(a, self.settings) for r in self.settings.robots.values() for a in r.axes}
        self.now = 10.0
        self.frames: list[CanFrame] = []
        self.events: list[Event] = []
        self.replies: dict[str, Reply] = {}
        self.feedback: DriveFeedback | None = None
        self.state: GatewayState | None = None
        self.manager: KindManager | None = None
        self.finished = False
        self.counted = 0
        self.sequence = 0
        self.living = 0
        """Owner whose agent sends a hold every few cycles while nothing else is to be played."""
        self._back: list[object] = []

    def cycle(self, lateness_s: float = 0.0) -> None:
        self.now += CYCLE_S + lateness_s
        back, self._back = self._back, []
        for message in back:
            self.core.receive(message, self.now)
        for effect in self.core.step(self.now):
            match effect:
                case Frame(frame):
                    self.frames.append(frame)
                    for drive in self.drives.values():
                        self._back += drive.take(frame)
                case Sdo():
                    self._back.append(self.drives[effect.node_id].sdo(effect))
                case Publish(DriveFeedback() as feedback):
                    self.feedback = feedback
                case Publish(GatewayState() as state):
                    self.state = state
                    if self.manager is not None:
                        self.tell(self.manager.answer(state, self.now))
                case Publish(Event() as event):
                    self.events.append(event)
                case Answer(request_id, reply):
                    assert isinstance(reply, Reply)
                    self.replies[request_id] = reply
                case Ended():
                    self.finished = True
        for drive in self.drives.values():
            self._back += drive.beat(self.now)
        if self.living and self.feedback.tick % 5 == 0 and self.feedback.level == 0:
            self.hold(self.living)

    def tell(self, *messages: object) -> None:
        self._back += messages

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / CYCLE_S)):
            self.cycle()

    def until(self, happened: object, within_s: float = 5.0) -> None:
        for _ in range(round(within_s / CYCLE_S)):
            if happened():  # type: ignore[operator]
                return
            self.cycle()
        raise AssertionError(f"did not happen within {within_s} s; events: {[e.text for e in self.events]}")

    def request(self, command: Command, call_id: str = "") -> str:
        self.counted += 1
        request_id = f"r{self.counted}"
        heard = echo_for(command, self.state, self.feedback)
        self.tell(Request(request_id, Call(call_id or f"c{self.counted}", command, heard)))
        return request_id

    def ask(self, command: Command) -> Reply:
        self.until(lambda: self.state is not None)
        request_id = self.request(command)
        self.until(lambda: request_id in self.replies)
        return self.replies[request_id]

    def claim(self, boot: str = "a1") -> int:
        reply = self.ask(Claim("left", boot, "d"))
        assert reply.claim is not None, reply.text
        return reply.claim.owner

    def ready(self) -> None:
        self.until(lambda: self.state is not None and self.state.ready)

    def enabled(self, boot: str = "a1") -> int:
        """Bring up, claim and enable; answers the owner."""
        self.ready()
        self.until(lambda: self.feedback is not None)
        owner = self.claim(boot)
        reply = self.ask(EnableDrives("left", owner))
        assert reply.ok, reply.text
        self.until(lambda: self.feedback.enabled)
        return owner

    def send(self, owner: int, position: np.ndarray, velocity: np.ndarray, lead: int = 5) -> int:
        """Send a block; answers its first tick."""
        self.sequence += 1
        first_tick = self.feedback.tick + lead
        self.tell(block(owner, self.sequence, first_tick, position, velocity))
        return first_tick

    def hold(self, owner: int, samples: int = 4) -> None:
        self.send(owner, np.tile(self.feedback.commanded, (samples, 1)), np.zeros((samples, len(self.drives))))

    def codes(self) -> list[str]:
        return [event.code for event in self.events]


def s_motion(duration_s: float, distance: float, n: int = 2, cycle_s: float = CYCLE_S) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity, `(m, n)`, of a smooth move from rest to rest (fifth-order polynomial)."""
    t = np.arange(0.0, duration_s + cycle_s / 2, cycle_s) / duration_s
    s = t**3 * (10 - 15 * t + 6 * t**2)
    v = 30 * t**2 * (1 - t) ** 2 / duration_s
    return np.outer(s, np.full(n, distance)), np.outer(v, np.full(n, distance))


def block(
    owner: int, sequence: int, first_tick: int, position: np.ndarray, velocity: np.ndarray, nominal: int | None = None
) -> SetpointBlock:
    count = len(position) if nominal is None else nominal
    return SetpointBlock("left", owner, sequence, sequence - 1, first_tick, CYCLE_S, count, position, velocity)
