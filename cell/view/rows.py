"""What is told alike on the page and in a terminal: plain words and numbers, in rows."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

from cell.messages import AxisStatus, DriveFeedback, Event, GatewayState, NodeStatus
from cell.view.newest import Newest
from cell.view.now import Tone

SIMULATED_BUSES = frozenset({"virtual", "udp_multicast"})
"""Of python-can: no machine is on them."""
BURST_S = 10.0
"""Alike events that follow each other so soon are one line."""
_NUMBER = re.compile(r"\d+")
AXIS_HEADING = ("axis", "drive", "position", "speed", "behind", "worst", "torque", "current", "temp.")
_ALWAYS = AXIS_HEADING.index("torque")
"""The columns in front of this one stand there even if they are empty."""


class Kind(Enum):
    """Whether machines move."""

    SILENT = "nobody answers"
    SIMULATED = "SIMULATED"
    REAL = "REAL MACHINES"

    @classmethod
    def of(cls, seen: Newest) -> "Kind":
        """As the buses say it; one that a machine may be on makes the cell real."""
        buses = {state.interface for state in seen.of(GatewayState).values()}
        if not buses:
            return cls.SILENT
        return cls.SIMULATED if buses <= SIMULATED_BUSES else cls.REAL


@dataclass(frozen=True, slots=True)
class Axes:
    """The axes of a robot by its file."""

    names: tuple[str, ...]
    sliding: tuple[bool, ...]


@dataclass(frozen=True, slots=True)
class AxisRow:
    """One axis: its cells below `AXIS_HEADING`, and how its drive looks."""

    cells: tuple[str, ...]
    tone: Tone


def axis_rows(robot: str, axes: Axes, seen: Newest) -> list[AxisRow]:
    """Of each axis the state of its drive, where it is, how fast, how far behind, in mm and degrees; its torque,
    the current of its motor and a temperature."""
    nodes = {
        node.axis: node for gateway in seen.of(GatewayState).values() for node in gateway.nodes if node.robot == robot
    }
    feedback = seen.of(DriveFeedback).get(robot)
    if feedback is not None and len(feedback.position) != len(axes.names):
        feedback = None
    return [_axis_row(i, axes, nodes, feedback) for i in range(len(axes.names))]


def axis_columns(rows: Sequence[AxisRow]) -> list[int]:
    """Which columns are worth their width: what no drive of the robot tells has none."""
    return [i for i in range(len(AXIS_HEADING)) if i < _ALWAYS or any(row.cells[i] for row in rows)]


def _axis_row(i: int, axes: Axes, nodes: Mapping[str, NodeStatus], feedback: DriveFeedback | None) -> AxisRow:
    name, sliding, node = axes.names[i], axes.sliding[i], nodes.get(axes.names[i])
    words, tone = _drive(node, feedback.axes[i] if feedback is not None else None)
    scale, unit = (1000.0, "mm") if sliding else (math.degrees(1.0), "°")
    worst = "" if node is None or node.following_error is None else f"{scale * node.following_error:.3f}"
    current = "" if node is None or node.current_a is None else f"{node.current_a:z.2f} A"
    temperature = "" if node is None or node.temperature_c is None else f"{node.temperature_c:.0f} °C"
    if feedback is None:
        return AxisRow((name, words, "", "", "", worst, "", current, temperature), tone)
    torque = "" if feedback.torque is None else f"{feedback.torque[i]:z.1f} {'N' if sliding else 'Nm'}"
    return AxisRow(
        (
            name,
            words,
            f"{scale * feedback.position[i]:z.2f} {unit}",
            f"{scale * feedback.velocity[i]:z.1f} {unit}/s",
            f"{scale * (feedback.commanded[i] - feedback.position[i]):+z.3f}",
            worst,
            torque,
            current,
            temperature,
        ),
        tone,
    )


def _drive(node: NodeStatus | None, status: AxisStatus | None) -> tuple[str, Tone]:
    if node is None:
        return "not told", Tone.STANDS
    drive = status if status is not None else node.drive
    words = drive.words + ("" if node.referenced else ", not referenced") + (", warns" if node.warning else "")
    if node.emergency_code:
        words += f"; {node.emergency_code:04X}h {node.emergency_text}"
    if drive in (AxisStatus.FAULT, AxisStatus.FAULT_REACTION_ACTIVE, AxisStatus.SILENT):
        return words, Tone.ALARM
    return words, Tone.WAITS if node.warning or not node.referenced else Tone.MOVES


def duration(seconds: float) -> str:
    """For people, in one unit."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.0f} h"


@dataclass(slots=True)
class Burst:
    """An event that came again and again, in words that differ by their numbers alone."""

    newest: Event
    at: float
    oldest_at: float
    count: int = 1

    @property
    def lasted(self) -> str:
        """How often in which time; empty for one that came once."""
        return f" ({self.count} times in {duration(self.at - self.oldest_at)})" if self.count > 1 else ""


def bursts(newest_first: Iterable[tuple[Event, float]]) -> list[Burst]:
    """Each at the place of its newest event."""
    found: dict[tuple[str, ...], Burst] = {}
    every: list[Burst] = []
    for event, at in newest_first:
        key = event.source, event.code, event.severity.value, _NUMBER.sub("", event.text)
        burst = found.get(key)
        if burst is not None and burst.oldest_at - at <= BURST_S:
            burst.oldest_at, burst.count = at, burst.count + 1
        else:
            found[key] = Burst(event, at, at)
            every.append(found[key])
    return every
