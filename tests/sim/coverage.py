"""What a run, and many runs together, have seen: states, transitions, refusals, events, faults."""

import ast
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import lru_cache
from pathlib import Path

from cell.messages import (
    Clearance,
    DriveFeedback,
    Event,
    ManagerState,
    Mode,
    PlayoutState,
    Presence,
    ProgramState,
    RobotState,
    ZoneState,
)
from drive_gateway.gateway.playout.joining import JoinRule
from tests.sim.faults import KINDS, MOMENTS, ORDERS, ROOM_MOMENTS, Item, meets_another
from tests.sim.judge.facts import Facts
from tests.sim.world import World

_ROOT = Path(__file__).parents[2]
_SOURCES = ("cell/manager", "robot_agent/agent", "drive_gateway/gateway")
_TELLERS = ("event", "_tell", "info", "warn", "warn_repeated", "warn_of_many", "alarm", "Trouble")


class Coverage:
    """Counts what happens in one world."""

    def __init__(self, world: World, facts: Facts) -> None:
        self.counts: Counter[str] = Counter()
        self.contended = False
        self.events: list[str] = []
        """For people, in a replay."""
        self._facts = facts
        self._modes: dict[str, Mode] = {}
        self._programs: dict[str, ProgramState] = {}
        self._zones: dict[str, ZoneState] = {}
        self._holders: dict[str, str | None] = {}
        self._playouts: dict[str, PlayoutState] = {}
        self._wanting: dict[str, set[str]] = {}
        world.on_published.append(self._published)
        world.on_life.append(self._lived)
        self._world = world

    def struck(self, struck: Iterable[tuple[float, Item]]) -> None:
        """What the plan has done."""
        for _, item in struck:
            self.counts[f"fault {item.kind}"] += 1
            if item.moment is not None:
                self.counts[f"moment {item.moment.what}"] += 1
            for order in (getattr(item, "order", ""), getattr(item, "then", "")):
                if order:
                    self.counts[f"order {order}"] += 1

    def _lived(self, name: str, what: str) -> None:
        self.counts[f"{what} {name.partition('/')[0]}"] += 1
        self.events.append(f"{self._facts.now - self._facts.start:8.3f} {name:16s} {what}")

    def _published(self, _: str, message: object) -> None:
        match message:
            case RobotState():
                self._change("mode", message.robot, self._modes, message.mode)
                self._change("program", message.robot, self._programs, message.program.state)
            case ManagerState():
                self._state(message)
            case DriveFeedback():
                self._change("playout", message.robot, self._playouts, message.state)
            case Event():
                self.counts[f"event {message.code}"] += 1
                at_s = self._facts.now - self._facts.start
                self.events.append(f"{at_s:8.3f} {message.source:16s} {message.code:16s} {message.text}")
                if message.code == "block_refused":
                    self.counts[f"refusal {message.text.partition('refused (')[2].partition(')')[0]}"] += 1
            case Clearance() if meets_another(message):
                self.counts["room refused"] += 1
                self.contended |= not self._facts.cell.zones
            case Presence():
                for zone in message.wants:
                    wanting = self._wanting.setdefault(zone, set())
                    wanting.add(message.robot)
                for zone, wanting in self._wanting.items():
                    if zone not in message.wants and zone not in message.holds:
                        wanting.discard(message.robot)
                    self.contended |= len(wanting) > 1

    def _state(self, state: ManagerState) -> None:
        for zone, status in state.zones.items():
            self._change("zone", zone, self._zones, status.state)
            if status.holder is not None and self._holders.get(zone) != status.holder:
                self.counts["grants"] += 1
            self._holders[zone] = status.holder
            if "must get through before" in status.reason:
                self.counts["zone put off"] += 1

    def _change(self, what: str, who: str, known: dict[str, object], new: object) -> None:  # type: ignore[type-arg]
        before = known.get(who)
        if before is new:
            return
        known[who] = new
        word = new.name.lower()  # type: ignore[attr-defined]
        self.counts[f"{what} {word}"] += 1
        if before is not None:
            self.counts[f"{what} {before.name.lower()} to {word}"] += 1  # type: ignore[attr-defined]


# What must be seen

_ZONE_WAYS = (
    "free to granted", "granted to occupied", "occupied to granted", "granted to free", "granted to orphaned",
    "occupied to orphaned", "orphaned to granted", "orphaned to free", "orphaned to occupied",
)  # fmt: skip
_MODE_WAYS = (
    "starting to disabled", "disabled to enabling", "enabling to ready", "ready to running", "running to ready",
    "running to halted", "halted to running", "halted to jogging", "jogging to ready", "running to estop",
    "estop to disabled", "running to fault", "fault to disabled", "enabling to halted", "enabling to off_path",
    "off_path to returning", "returning to halted",
)  # fmt: skip
_REFUSALS = (JoinRule.SEQUENCE, JoinRule.LATE, JoinRule.POSITION, JoinRule.OWNER)
"""The others are for blocks that no agent sends."""


def must_be_seen() -> set[str]:
    """What a long search has to have seen at least once."""
    return {
        *(f"mode {mode.name.lower()}" for mode in Mode),
        *(f"zone {state.name.lower()}" for state in ZoneState),
        *(f"playout {state.name.lower()}" for state in PlayoutState),
        *(f"zone {way}" for way in _ZONE_WAYS),
        "zone put off",
        "room refused",
        *(f"mode {way}" for way in _MODE_WAYS),
        *(f"refusal {refusal.value}" for refusal in _REFUSALS),
        *(f"fault {kind.kind}" for kind in KINDS),
        *(f"moment {moment}" for moment in {*MOMENTS, *ROOM_MOMENTS}),
        *(f"order {order}" for order in ORDERS),
        *(f"event {code}" for code in event_codes() - ELSEWHERE.keys()),
    }


@lru_cache(maxsize=1)
def event_codes() -> frozenset[str]:
    """The codes of all events that manager, agents and gateways have in their sources."""
    codes: set[str] = set()
    for folder in _SOURCES:
        for file in sorted((_ROOT / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(file.read_text())):
                if isinstance(node, ast.Call) and _called(node) in _TELLERS:
                    codes |= {code for code in map(_code, node.args[:2]) if code}
    return frozenset(codes)


def _called(node: ast.Call) -> str:
    function = node.func
    return function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")


def _code(argument: ast.expr) -> str:
    value = argument.value if isinstance(argument, ast.Constant) else ""
    return value if isinstance(value, str) and value.replace("_", "").isalnum() and value.islower() else ""


ELSEWHERE = {
    "call_failed": "unit/drive_gateway/gateway/orders/test_order_age.py",
    "correction": "sim/test_sim_corrections.py",
    "drive_warning": "sim/test_sim_warnings.py",
    "drive_warning_over": "sim/test_sim_warnings.py",
    "estop_over": "unit/cell/manager/test_core.py",
    "frame_moved": "unit/cell/manager/test_frames.py",
    "io_warning": "sim/test_sim_io_nodes.py",
    "late_for_meeting": "unit/robot_agent/agent/program/test_meetings.py",
    "left_enabled": "sim/test_sim_faults.py",
    "limit_switch": "sim/test_sim_limit_switches.py",
    "meeting_deadlock": "unit/cell/manager/test_meeting_deadlock.py",
    "mode_refused": "sim/test_sim_setup.py",
    "moves_without_torque": "sim/test_sim_stops.py",
    "not_off": "sim/test_sim_stops.py",
    "not_referenced": "sim/test_sim_endless.py",
    "object_missing": "sim/test_sim_waived_objects.py",
    "program": "unit/robot_agent/agent/test_core.py",
    "recorded": "unit/drive_gateway/gateway/orders/test_objects.py",
    "return": "unit/robot_agent/agent/program/test_interruption.py",
    "setup": "sim/test_sim_setup_in_a_cell.py",
    "setup_cleared": "unit/cell/manager/test_setup.py",
    "setup_done": "sim/test_sim_setup.py",
    "setup_stopped": "sim/test_sim_setup.py",
    "simulation_slow": "unit/drive_gateway/gateway/test_core.py",
    "stop_deadline": "sim/test_sim_stops.py",
    "zone_changed": "unit/cell/manager/test_zone_changes.py",
    "zone_deadlock": "sim/test_sim_deadlock.py",
}
"""Events of what no generated cell does, and the test that has each: drives with a fault or a setting of their own, I/O
nodes, set-up, frames and zones that are changed, meetings, programs that are wrong, agents that are."""


def unseen(counts: Counter[str]) -> list[str]:
    """What must be seen and was not."""
    return sorted(each for each in must_be_seen() if not counts[each])


def table(counts: Counter[str], columns: Sequence[str]) -> list[str]:
    """Lines for people: kinds of things and how often each was seen."""
    lines = []
    for column in columns:
        mine = {name[len(column) + 1 :]: n for name, n in sorted(counts.items()) if name.startswith(column + " ")}
        lines.append(f"{column}: " + ", ".join(f"{name} {n}" for name, n in mine.items()))
    return lines
