"""Drives whose signs of life are late, odd, or of the older kind."""

from collections import deque
from dataclasses import replace
from itertools import cycle

from drive_gateway.canopen.cob_id import ERROR_CONTROL, function_code
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.nmt import NmtState
from drive_gateway.sim.drives.power_state import DriveState
from drive_gateway.sim.nodes.node import SimulatedNode
from drive_gateway.sim.services.dictionary import key_of
from tests.sim.unkind.traits.habits import sends
from tests.sim.unkind.traits.trait import Trait

_PRODUCER = key_of(0x1017)
_STEP_MS = 16
_LATE_S = (0.0, 0.12, 0.04, 0.0, 0.09)
_PAUSE_S = 0.3
_AGAIN_S = 0.03
_SHOWN_LATE_S = 0.4


def _is_heartbeat(frame: CanFrame) -> bool:
    return function_code(frame.id) == ERROR_CONTROL and frame.data != bytes((NmtState.BOOT_UP,))


def _in_steps(node: SimulatedNode) -> None:
    """It keeps whole steps of its timer, and more rather than less."""
    configured = node.objects.followers[_PRODUCER]

    def rounded(value: int) -> None:
        node.objects.numbers[_PRODUCER] = -(-value // _STEP_MS) * _STEP_MS
        configured(node.objects.numbers[_PRODUCER])

    node.objects.followers[_PRODUCER] = rounded


def _jitters(node: SimulatedNode) -> None:
    late_s, waiting = cycle(_LATE_S), deque[tuple[float, CanFrame]]()

    def late(frames: list[CanFrame], now: float) -> list[CanFrame]:
        waiting.extend((now + next(late_s), frame) for frame in frames if _is_heartbeat(frame))
        others = [frame for frame in frames if not _is_heartbeat(frame)]
        while waiting and waiting[0][0] <= now:
            others.append(waiting.popleft()[1])
        return others

    sends(node, late)


def _pauses(node: SimulatedNode) -> None:
    """It has no time for heartbeats for a moment after its motor got current."""
    since: float | None = None

    def quiet(frames: list[CanFrame], now: float) -> list[CanFrame]:
        nonlocal since
        if node.state is not DriveState.OPERATION_ENABLED:
            since = None
        elif since is None:
            since = now
        if since is None or now - since > _PAUSE_S:
            return frames
        return [frame for frame in frames if not _is_heartbeat(frame)]

    sends(node, quiet)


def _boots_up_twice(node: SimulatedNode) -> None:
    again: list[tuple[float, CanFrame]] = []

    def twice(frames: list[CanFrame], now: float) -> list[CanFrame]:
        due = [frame for at, frame in again if at <= now]
        again[:] = [(at, frame) for at, frame in again if at > now]
        again.extend(
            (now + _AGAIN_S, frame)
            for frame in frames
            if function_code(frame.id) == ERROR_CONTROL and not _is_heartbeat(frame)
        )
        return frames + due

    sends(node, twice)


def _start_shown_late(node: SimulatedNode) -> None:
    """Its process data come from its start on."""
    started: float | None = None

    def shown(frames: list[CanFrame], now: float) -> list[CanFrame]:
        nonlocal started
        if node.nmt is not NmtState.OPERATIONAL:
            started = None
        elif started is None:
            started = now
        if started is None or now - started > _SHOWN_LATE_S:
            return frames
        before = bytes((NmtState.PRE_OPERATIONAL,))
        return [replace(frame, data=before) if _is_heartbeat(frame) else frame for frame in frames]

    sends(node, shown)


def _guarding_only(node: SimulatedNode) -> None:
    node.objects.lack(0x1016)
    node.objects.lack(0x1017)


HEARTBEAT = (
    Trait(
        "heartbeat_in_its_own_steps",
        "Takes any heartbeat time and keeps the next longer multiple of 16 ms.",
        "CiA 301, object 1017h: a multiple of 1 ms; makers round it to their own timer",
        _in_steps,
    ),
    Trait(
        "heartbeat_jitters",
        "Sends its heartbeats up to 0.12 s late, now more, now less.",
        "CANopenNode issue 532: heartbeats of 100 ms come more than 250 ms apart at 30 % bus load",
        _jitters,
    ),
    Trait(
        "heartbeat_pauses",
        "Sends no heartbeat for 0.3 s after operation was enabled; its TPDOs come.",
        "CANopenNode issue 532: heartbeats of 100 ms come more than 250 ms apart at 30 % bus load",
        _pauses,
    ),
    Trait(
        "boots_up_twice",
        "Sends its boot-up message again 30 ms after the first.",
        "canopen-stack issue 133: the stack sends it when it is started, so firmware that sends it by hand before that "
        "sends it twice",
        _boots_up_twice,
    ),
    Trait(
        "start_shown_late",
        "Its heartbeat says Pre-operational for 0.4 s after it was started.",
        "CiA 301, NMT: commands are not confirmed, and no time is prescribed until the heartbeat shows their effect",
        _start_shown_late,
    ),
    Trait(
        "guarding_only",
        "Has node guarding (100Ch, 100Dh) and no heartbeat (1016h, 1017h).",
        "Kollmorgen S300-S700 CANopen manual, object 1017h: mandatory only if guarding is not supported",
        _guarding_only,
    ),
)
"""Habits with signs of life."""
