"""Drives that want to know more of SYNC than that it comes."""

from drive_gateway.canopen.cob_id import SYNC
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.sim.drives.drive import CONTROLWORD
from drive_gateway.sim.nodes.node import SimulatedNode
from drive_gateway.sim.services.abort import Abort, AccessRefused
from drive_gateway.sim.services.dictionary import key_of
from tests.sim.unkind.traits.habits import constant, number, refuses, sends
from tests.sim.unkind.traits.trait import Trait

_PRODUCES = 1 << 30
_ENABLE = 0x0F
_PERIOD, _COUNTER, _IDENTIFIER = key_of(0x1006), key_of(0x1019), key_of(0x1005)
_US = 1e6
_WITHIN = 0.02


def _has_period(node: SimulatedNode, value: int) -> None:
    node.objects.declare(number(0x1006, 0, "I", value, "Communication cycle period"))


def _locks_to_period(node: SimulatedNode) -> None:
    """It does not enable operation before the SYNCs that it hears are apart by what 1006h says."""
    _has_period(node, 10_000)
    heard: list[float] = []
    received = node.receive

    def receive(frame: CanFrame, now: float) -> list[CanFrame]:
        if frame.id == SYNC:
            heard[:] = [*heard[-1:], now]
        return received(frame, now)

    def locked(word: int) -> None:
        period_s = node.objects.numbers[_PERIOD] / _US
        apart_s = heard[1] - heard[0] if len(heard) == 2 else 0.0
        if word & _ENABLE == _ENABLE and abs(apart_s - period_s) > _WITHIN * period_s:
            raise AccessRefused(Abort.DEVICE_STATE)

    node.receive = receive  # type: ignore[method-assign]
    node.objects.guard(CONTROLWORD, locked)


def _fixed_period(node: SimulatedNode) -> None:
    _has_period(node, 10_000)
    constant(node, 0x1006, 0, 10_000)


def _counts(node: SimulatedNode) -> None:
    """With a counter it hears no SYNC without one; the counter changes only while the period is 0."""
    _has_period(node, 10_000)
    node.objects.declare(number(0x1019, 0, "B", 240, "Synchronous counter overflow value"))
    numbers, received = node.objects.numbers, node.receive

    def receive(frame: CanFrame, now: float) -> list[CanFrame]:
        if frame.id == SYNC and bool(numbers[_COUNTER]) != bool(frame.data):
            return []
        return received(frame, now)

    node.receive = receive  # type: ignore[method-assign]
    refuses(node, 0x1019, 0, Abort.DEVICE_STATE, lambda _value: numbers[_PERIOD] != 0)
    refuses(node, 0x1019, 0, Abort.RANGE, lambda value: value == 1 or value > 240)


def _sends_sync(node: SimulatedNode) -> None:
    """As long as bit 30 of 1005h is set it sends SYNC, at the period of 1006h."""
    _has_period(node, 20_000)
    numbers = node.objects.numbers
    entry = node.objects.entry(_IDENTIFIER)
    node.objects.declare(number(0x1005, 0, "I", SYNC | _PRODUCES, entry.name))
    due = 0.0

    def beside(frames: list[CanFrame], now: float) -> list[CanFrame]:
        nonlocal due
        if numbers[_IDENTIFIER] & _PRODUCES and numbers[_PERIOD] and now >= due:
            due = now + numbers[_PERIOD] / _US
            return [*frames, CanFrame(SYNC, b"")]
        return frames

    sends(node, beside)


SYNC_HABITS = (
    Trait(
        "cycle_period_needed",
        "Enables operation only while SYNC comes with the period of 1006h, which is 10 ms from its factory.",
        "isel IMD20 manual, interpolation: the SYNC interval must be entered in 1006h; Infranor XtraPulsGem manual, "
        "1006h: default 10000, at 0 the synchronisation is not operative",
        _locks_to_period,
    ),
    Trait(
        "fixed_cycle_period",
        "Knows one SYNC period, 10 ms, and its 1006h can only be read.",
        "CiA 301, object 1006h: values that a device does not support are refused",
        _fixed_period,
    ),
    Trait(
        "sync_with_counter",
        "Comes up expecting a counter of 240 in SYNC, hears none without it, and changes that only while 1006h is 0.",
        "CiA 301, object 1019h: refused by 08000022h unless 1006h is 0; SYNC of another length is 8240h",
        _counts,
    ),
    Trait(
        "sends_sync",
        "Sends SYNC itself until bit 30 of its 1005h is cleared.",
        "CiA 301, object 1005h, bit 30; Bonfiglioli ACU CANopen manual, 12.2.3: the device generates the SYNC message",
        _sends_sync,
    ),
)
"""Habits with SYNC."""
