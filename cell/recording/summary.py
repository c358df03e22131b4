"""What a recording says in numbers: modes, zones, who waited for whom, distances, lateness, what each robot did."""

import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from cell.geometry import capsule_distance
from cell.messages import (
    Clearance,
    Event,
    GatewayState,
    ManagerState,
    Mode,
    Presence,
    RobotState,
    Severity,
    ZoneState,
)

SILENT_S = 1.0
"""Who says nothing for longer is silent in between."""
LOOK_S = 0.1
"""So far apart are the values of a curve."""
LATELY_S = 0.25
"""Where a robot was longer ago is not where it is."""
TOLD_BY = frozenset({Clearance, Event, GatewayState, ManagerState, Presence, RobotState})
"""What the numbers are of; nothing else need be read."""
CLEARED_SPACE = "cleared space"
"""For what a robot says that it waits until it has read why it has no room."""
MOVES, WAITS = "moves", "waits"
Heard = tuple[object, float]
"""A message, and when it was heard: seconds since 1970 (UTC)."""
_NUMBER = re.compile(r"\d+(?:\.\d+)?")
_WORKS = frozenset({Mode.RUNNING, Mode.RETURNING, Mode.JOGGING})


@dataclass(frozen=True, slots=True)
class Span:
    """From `begin` to `end`, seconds since 1970, something was `what`; `by` whom, where somebody is behind it."""

    begin: float
    end: float
    what: str
    by: str = ""

    @property
    def seconds(self) -> float:
        return self.end - self.begin


@dataclass(slots=True)
class Curve:
    """Values `y` at times `x`, seconds since 1970."""

    x: list[float] = field(default_factory=list)
    y: list[float] = field(default_factory=list)

    def add(self, x: float, y: float) -> None:
        self.x.append(x)
        self.y.append(y)


@dataclass(slots=True)
class Summary:
    """Of a whole recording; everything by name."""

    began: float
    ended: float
    modes: dict[str, list[Span]]
    """By robot."""
    use: dict[str, dict[str, float]]
    """By robot the seconds in which it moved, waited though its program ran, or was in another mode."""
    waits: dict[str, list[Span]]
    """By robot: for what, and for whom."""
    zones: dict[str, list[Span]]
    """By zone its state, and who held it."""
    distances: dict[tuple[str, str], Curve]
    """By pair of robots [m], of their measured bodies, what these may have moved since being told counted in."""
    lateness: dict[str, Curve]
    """By gateway the worst lateness of a cycle so far [s]."""
    late_cycles: dict[str, tuple[int, int]]
    """By gateway how many were late within the recording, of how many."""
    alarms: list[tuple[float, Event]]

    def waited(self) -> dict[tuple[str, str, str], tuple[int, float]]:
        """By robot, for what and for whom: how often, and how long in all [s]; the longest first."""
        total: dict[tuple[str, str, str], tuple[int, float]] = {}
        for robot, spans in self.waits.items():
            for span in spans:
                times, seconds = total.get((robot, span.what, span.by), (0, 0.0))
                total[robot, span.what, span.by] = times + 1, seconds + span.seconds
        return dict(sorted(total.items(), key=lambda each: -each[1][1]))


def summary(messages: Iterable[Heard], began: float) -> Summary:
    """Go through a recording that `began` then, once. What was heard before is what is known at its begin."""
    seen = _Seen(began)
    for message, at in messages:
        seen.hear(message, at)
    return seen.summary()


class _Line:
    """Spans of one thing, as its state is heard again and again."""

    def __init__(self) -> None:
        self.spans: list[Span] = []
        self._open: Span | None = None

    def hear(self, at: float, what: str, by: str = "") -> float:
        """What it is at `at`; the time since it was heard last, 0 after silence."""
        last = self._open
        if last is None or at - last.end > SILENT_S:
            self._close()
            self._open = Span(at, at, what, by)
            return 0.0
        self._open = Span(last.begin, at, last.what, last.by)
        if (what, by) != (last.what, last.by):
            self._close()
            self._open = Span(at, at, what, by)
        return at - last.end

    def all(self) -> list[Span]:
        """Those with a name."""
        self._close()
        return [span for span in self.spans if span.what]

    def _close(self) -> None:
        if self._open is not None:
            self.spans.append(self._open)
            self._open = None


class _Seen:
    """What was heard so far."""

    def __init__(self, began: float) -> None:
        self._began = self._ended = began
        self._modes: dict[str, _Line] = defaultdict(_Line)
        self._waits: dict[str, _Line] = defaultdict(_Line)
        self._zones: dict[str, _Line] = defaultdict(_Line)
        self._use: dict[str, dict[str, float]] = defaultdict(lambda: defaultdict(float))
        self._doing: dict[str, str] = {}
        self._manager: ManagerState | None = None
        self._clearances: dict[str, Clearance] = {}
        self._bodies: dict[str, tuple[Presence, float]] = {}
        self._distances: dict[tuple[str, str], Curve] = defaultdict(Curve)
        self._lateness: dict[str, Curve] = defaultdict(Curve)
        self._cycles: dict[str, list[tuple[int, int]]] = defaultdict(list)
        self._alarms: list[tuple[float, Event]] = []

    def hear(self, message: object, at: float) -> None:
        self._ended = max(self._ended, at)
        match message:
            case RobotState():
                self._robot(message, at)
            case ManagerState():
                self._manager = message
                for name, zone in message.zones.items():
                    by = zone.holder if zone.state is not ZoneState.FREE else None
                    self._zones[name].hear(at, zone.state.value, by or "")
            case Clearance():
                self._clearances[message.robot] = message
            case Presence() if message.body.known and len(message.body.poses):
                self._bodies[message.robot] = message, at
                self._look(message.robot, at)
            case Presence():
                self._bodies.pop(message.robot, None)
            case GatewayState():
                counters = message.counters
                self._lateness[message.gateway].add(at, counters.worst_lateness_s)
                self._cycles[message.gateway].append((counters.late_cycles, counters.ticks))
            case Event() if message.severity is Severity.ALARM:
                self._alarms.append((at, message))

    def _robot(self, state: RobotState, at: float) -> None:
        since = self._modes[state.robot].hear(at, state.mode.value)
        if since:
            self._use[state.robot][self._doing[state.robot]] += since
        waits = bool(state.waiting_for) and state.mode in _WORKS
        self._doing[state.robot] = (WAITS if waits else MOVES) if state.mode in _WORKS else state.mode.value
        self._waits[state.robot].hear(at, *(self._why(state) if waits else ("", "")))

    def _why(self, state: RobotState) -> tuple[str, str]:
        """For what a robot waits, without numbers that count, and for whom."""
        reason = state.waiting_for
        for name, zone in self._manager.zones.items() if self._manager is not None else ():
            if reason.startswith(f"zone {name}:"):
                return f"zone {name}", zone.holder if zone.holder not in (None, state.robot) else ""
        clearance = self._clearances.get(state.robot)
        refused = None if clearance is None else clearance.refused
        if refused is not None and reason in (refused.text, CLEARED_SPACE):
            return "room", refused.by
        return _NUMBER.sub("…", reason), ""

    def _look(self, robot: str, at: float) -> None:
        """How far a robot is from the others that were heard lately; of each `LOOK_S` the least is kept."""
        for other, (body, heard) in self._bodies.items():
            if other == robot or at - heard > LATELY_S:
                continue
            metres = _distance(self._bodies[robot][0], body)
            curve = self._distances[min(robot, other), max(robot, other)]
            if not curve.x or at - curve.x[-1] > LOOK_S:
                curve.add(at, metres)
            else:
                curve.y[-1] = min(curve.y[-1], metres)

    def summary(self) -> Summary:
        cycles = {name: (all_[0], all_[-1]) for name, all_ in self._cycles.items()}
        return Summary(
            self._began,
            self._ended,
            {name: line.all() for name, line in self._modes.items()},
            {name: dict(use) for name, use in self._use.items()},
            {name: line.all() for name, line in self._waits.items()},
            {name: line.all() for name, line in self._zones.items()},
            dict(self._distances),
            dict(self._lateness),
            {name: (last[0] - first[0], last[1] - first[1]) for name, (first, last) in cycles.items()},
            self._alarms,
        )


def _distance(one: Presence, other: Presence) -> float:
    """Of two bodies where they are now [m]."""
    first, second = one.body, other.body
    radii = first.radii_m + first.growth_m[0], second.radii_m + second.growth_m[0]
    return float(
        np.min(capsule_distance(first.poses[0][:, None], radii[0][:, None], second.poses[0][None], radii[1][None]))
    )
