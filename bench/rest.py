"""How long after each kind of silence or fault a robot begins to brake: the rows of docs/architecture.md, section 6.

Real processes of the cell `belt`: one arm that goes to and fro on a line, is jogged along it, or is set up. A row tells
the time from the event until the flange is slower than before by 3 %; what passes to rest beyond that is its braking.
The ratio is to what section 6 allows for noticing and the way from there to the motor and back: for an agent its next
block, the lead of that, the lag of the drives, the cycle that shows it and what a ramp takes to lose 3 %; for a gateway
the rest of its cycle, two more and the lag. Below 1: in time. On a busy computer blocks come late, and the arm brakes
and goes on all the time; then the numbers are the computer's.

Not measured, because nothing brakes for it: a fresh presence, whose loss blocks zones. Not measured, because simulated
drives cannot fail so: a heartbeat that is lost while TPDOs come, and what should stand and does not (`does_not_stop`,
`moves_without_torque`, `not_off`). The tests and the simulated cell judge these on virtual time.
"""

import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path

import can
import numpy as np

from bench.rest_cell import ADAPTER_GONE, FOLLOWING, PLAIN, READY_S, REST_S, ROBOT, Floats, Held, RestCell, Track
from bench.timing import Row
from cell.messages import AxisStatus, Fault, FaultDrive
from drive_gateway.canopen.cob_id import ERROR_CONTROL, MASTER_NODE_ID, SDO_FROM_NODE, SDO_TO_NODE
from drive_gateway.gateway.bus.opening import open_bus
from drive_gateway.gateway.setup.setup_motion import HOLD_S
from robot_agent.agent.operator.jogging import HELD_S

TRIES = 3
BEGINS_S = 3.0
"""An arm that rests after so long has not begun to move, or was disturbed; a first motion in set-up tries the drives'
units, begins late and is short."""
SLOWER, STANDS_M_S = 0.97, 0.002
RAMP_SHOWS_S = 0.02
"""A jerk-limited ramp takes so long to make the arm slower by 3 %; a quick stop does it in a cycle."""
ESTOP_S = 0.3
"""From the start of `cell estop` to its first message."""
BLOCK_PERIOD_S = 0.02
FEEDBACK_CYCLES = 5
_FIRST, _LAST = 1, 6
"""Nodes. The last axis turns the flange about itself: the flange can be seen to brake whatever becomes of it."""
_JUMP_COUNTS = 2_000_000
"""Of the last axis: 70 deg, more than it can make good in its following time."""
_DROP_OUT_S = 1.0
_STATUSWORD, _POSITION, _SETPOINT_TIMEOUT = (0x6041, 2), (0x6064, 4), (0x2000, 1)
"""Objects of a drive and their bytes."""
_ENABLED_MASK, _ENABLED = 0x6F, 0x27

Motion = Callable[[RestCell], AbstractContextManager[Held | None]]
Cause = Callable[[RestCell, Held | None], object]
Seen = Callable[[Track, int], int]
"""Which message shows the event first, of those from a number on."""


@dataclass(frozen=True, slots=True)
class Case:
    """What happens, how the arm moves then, and what section 6 allows [s], with what leads from there to the motor."""

    what: str
    cause: Cause
    within_s: float
    way_s: float
    motion: Motion
    seen: Seen | None = None
    """`None`: the event is the moment of its cause."""
    alone: bool = False
    """The drives are on their own: they are asked over the bus."""


def rests() -> list[Row]:
    """All rows."""
    rows = list[Row]()
    for program, cases in ((PLAIN, _cases), (FOLLOWING, _cases_of_following)):
        with tempfile.TemporaryDirectory() as name, RestCell(Path(name), program) as cell:
            rows += [_row(cell, case) for case in cases(cell)]
    return rows


def _cases(cell: RestCell) -> list[Case]:
    return [*_agent_cases(cell), *_gateway_cases(cell)]


def _cases_of_following(cell: RestCell) -> list[Case]:
    fresh_s = cell.settings.robots[ROBOT].corrections["seam"].fresh_s
    return [Case("measurements that are followed", _kill("sensor"), fresh_s, _agent_way_s(cell), _run)]


def _agent_cases(cell: RestCell) -> list[Case]:
    """What the agent does, and what its blocks do without it."""
    times, way_s = cell.settings.times, _agent_way_s(cell)
    feedback_s = FEEDBACK_CYCLES * cell.drives.cycle_s + times.nominal_s
    return [
        Case("set-point blocks (agent frozen)", _freeze("agent"), times.nominal_s, way_s, _run),
        Case("drive feedback (kept back)", lambda cell, _: cell.link.keep_back(), feedback_s, way_s, _run),
        Case("a fresh manager state (manager killed)", _kill("manager"), times.fresh_s, way_s, _run),
        Case("`cell estop`, from its start", lambda cell, _: cell.operate("estop"), ESTOP_S, way_s, _run),
        Case("an operator's jog key", _let_go, HELD_S, way_s, RestCell.jog),
    ]


def _gateway_cases(cell: RestCell) -> list[Case]:
    """What the gateway does, and what its drives do without it."""
    drives, times, way_s = cell.drives, cell.settings.times, _gateway_way_s(cell)
    following_s = drives.robots[ROBOT].axes[-1].following_time_s
    with _Sdo(cell) as sdo:
        cell.bring_up()
        missed_s = min(sdo.read(_FIRST, *_SETPOINT_TIMEOUT) * drives.cycle_s, drives.heartbeat_timeout_s)
    return [
        Case("an EMCY", _fault(Fault.EMERGENCY, 0x2310, None), 0.0, way_s, _run, _shows_fault),
        Case(
            "a node's TPDO (cable out)",
            _fault(Fault.DROP_OUT, None, _DROP_OUT_S),
            drives.tpdo_timeout_s,
            way_s,
            _run,
            _is_silent,
        ),
        Case(
            "an encoder that jumps out of its window",
            _fault(Fault.ENCODER_JUMP, _JUMP_COUNTS, _DROP_OUT_S),
            following_s,
            way_s,
            _run,
            _jumps,
        ),
        Case("frames of a strange master", _command_by_another, 0.0, way_s, _run),
        Case("an operator's hold in set-up", _let_go, HOLD_S, way_s, RestCell.set_up),
        Case("the manager's word in set-up", _kill("manager"), times.fresh_s, way_s, RestCell.set_up),
        Case("the CAN bus (adapter gone)", _lose_adapter, missed_s, way_s, _run, alone=True),
        Case("SYNC (gateway killed)", _kill("gateway"), missed_s, way_s, _run, alone=True),
    ]


def _agent_way_s(cell: RestCell) -> float:
    drives = cell.drives
    return BLOCK_PERIOD_S + cell.settings.times.lead_s + cell.simulation.lag_s + drives.cycle_s + RAMP_SHOWS_S


def _gateway_way_s(cell: RestCell) -> float:
    return 3 * cell.drives.cycle_s + cell.simulation.lag_s


def _row(cell: RestCell, case: Case) -> Row:
    """The median of some tries."""
    tries = [_measured(cell, case) for _ in range(TRIES)]
    begin_s, rest_s = (float(np.median(each)) for each in zip(*tries, strict=True))
    spread = ", ".join(f"{1e3 * begin:.0f}" for begin, _ in tries)
    does = "its drive's own reaction" if case.alone else "braking"
    return Row(
        f"{case.what}: to {does} (each: {spread} ms; at rest after {1e3 * rest_s:.0f} ms)",
        begin_s,
        begin_s / (case.within_s + case.way_s),
        f"of {1e3 * case.within_s:.0f} ms and {1e3 * case.way_s:.0f} ms to the motor and back",
    )


def _measured(cell: RestCell, case: Case) -> tuple[float, float]:
    """When the robot brakes for good, and when it rests, both from the event [s]."""
    end = time.monotonic() + READY_S
    while time.monotonic() < end:
        with case.motion(cell) as held:
            begins = time.monotonic() + BEGINS_S
            track = cell.record(lambda t: t.steady or (t.at[-1] > begins and t.rests), REST_S)  # noqa: B023
            if not track.steady:
                continue
            begin_s, rest_s = _by_sdo(cell, case, held) if case.alone else _by_feedback(cell, case, held, track)
            # Before the event it brakes for something else, and an order may be too late on a busy computer.
            if begin_s > 0.0:
                return begin_s, rest_s
    raise RuntimeError(f"{case.what}: the arm does not move evenly; its state is {cell.state}")


def _by_feedback(cell: RestCell, case: Case, held: Held | None, track: Track) -> tuple[float, float]:
    cell.refused, count, event = "", len(track.at), time.monotonic()
    case.cause(cell, held)
    cell.record(lambda track: track.rests, REST_S, track)
    if not track.rests and cell.refused:
        return 0.0, 0.0
    if not track.rests:
        raise RuntimeError(f"{case.what}: no rest within {REST_S:g} s; {cell.refused}; {cell.state}")
    if case.seen is not None:
        event = track.at[case.seen(track, count)]
    at, speeds = track.speeds()
    fast = np.flatnonzero(speeds > SLOWER * float(np.median(speeds[at < event][-20:])))
    moving = np.flatnonzero(speeds > STANDS_M_S)
    return float(at[fast[-1]]) - event, float(at[moving[-1]]) - event


def _by_sdo(cell: RestCell, case: Case, held: Held | None) -> tuple[float, float]:
    """Nobody sends SYNC then: the first axis' drive says when it leaves Operation Enabled, and when it stands."""
    at, counts, disabled = list[float](), list[int](), None
    with _Sdo(cell) as sdo:
        event = time.monotonic()
        case.cause(cell, held)
        while disabled is None or counts[-1] != counts[-min(len(counts), 20)]:
            if time.monotonic() > event + REST_S:
                raise RuntimeError(f"{case.what}: node {_FIRST} does not stop within {REST_S:g} s")
            word = sdo.read(_FIRST, *_STATUSWORD)
            if disabled is None and word & _ENABLED_MASK != _ENABLED:
                disabled = time.monotonic()
            counts.append(sdo.read(_FIRST, *_POSITION))
            at.append(time.monotonic())
    stood = next(moment for moment, count in zip(at, counts, strict=True) if count == counts[-1])
    return disabled - event, stood - event


class _Sdo:
    """Reads objects of drives past the gateway. A context manager."""

    def __init__(self, cell: RestCell) -> None:
        self._bus = open_bus(cell.drives.bus)

    def __enter__(self) -> "_Sdo":
        return self

    def __exit__(self, *_: object) -> None:
        self._bus.shutdown()

    def read(self, node: int, index: int, size: int) -> int:
        """A number of so many bytes in sub-object 0. Raises `RuntimeError` when the node does not answer."""
        where = bytes((index & 0xFF, index >> 8, 0))
        end = time.monotonic() + REST_S
        while time.monotonic() < end:
            request = can.Message(arbitration_id=SDO_TO_NODE + node, data=b"\x40" + where + bytes(4))
            request.is_extended_id = False
            self._bus.send(request)
            until = time.monotonic() + 0.1
            while (left := until - time.monotonic()) > 0.0 and (message := self._bus.recv(left)) is not None:
                if message.arbitration_id == SDO_FROM_NODE + node and message.data[1:4] == where:
                    return int.from_bytes(message.data[4 : 4 + size], "little", signed=size == 4)
        raise RuntimeError(f"node {node} does not answer for {index:04X}h")


# Motions


def _run(cell: RestCell) -> AbstractContextManager[None]:
    cell.run()
    return nullcontext()


# Causes


def _freeze(name: str) -> Cause:
    return lambda cell, _: cell.freeze(name)


def _kill(name: str) -> Cause:
    return lambda cell, _: cell.processes[name].kill()


def _let_go(_: RestCell, held: Held | None) -> None:
    if held is not None:
        held.let_go()


def _lose_adapter(cell: RestCell, _: Held | None) -> None:
    cell.processes["gateway"].send_signal(ADAPTER_GONE)


def _command_by_another(cell: RestCell, _: Held | None) -> None:
    """A heartbeat of the master, which drives take without harm."""
    with open_bus(cell.drives.bus) as bus:
        bus.send(can.Message(arbitration_id=ERROR_CONTROL + MASTER_NODE_ID, data=b"\x05", is_extended_id=False))


def _fault(fault: Fault, value: int | None, seconds: float | None) -> Cause:
    """A fault of the last axis."""

    def cause(cell: RestCell, _: Held | None) -> None:
        order = FaultDrive(_LAST, 1, fault, value, seconds)
        threading.Thread(target=cell.ask_gateway, args=(order,), daemon=True).start()

    return cause


# What shows a fault of the last axis


def _shows_fault(track: Track, begin: int) -> int:
    enabled = AxisStatus.OPERATION_ENABLED
    return next(i for i in range(begin, len(track.said)) if track.said[i].axes[-1] is not enabled)


def _is_silent(track: Track, begin: int) -> int:
    """It turns all the time, so it is heard for the last time where it seems to stand."""
    turned = _turned(track)
    return next(i for i in range(begin, len(turned)) if turned[i] == 0.0) - 1


def _jumps(track: Track, begin: int) -> int:
    turned = _turned(track)
    return next(i for i in range(begin, len(turned)) if turned[i] > 0.1)


def _turned(track: Track) -> Floats:
    """[rad] by how much each message's place of the last axis differs from the one before."""
    places = np.array([message.position[-1] for message in track.said])
    return np.abs(np.diff(places, prepend=places[0]))
