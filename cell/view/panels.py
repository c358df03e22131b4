"""What the panels say, as HTML: every text that came from outside is escaped, whoever sent it."""

import math
from collections.abc import Iterable, Mapping
from html import escape
from itertools import islice

import numpy as np

from cell.config.settings import CellSettings
from cell.core import Arrived
from cell.geometry import pose_from, to_xyz_abc
from cell.geometry.arrays import Array
from cell.messages import (
    DriveFeedback,
    Event,
    FramePose,
    GatewayState,
    ManagerState,
    PlayoutState,
    Presence,
    RobotState,
    Severity,
    ZoneState,
)
from cell.messages.common import Count
from cell.view.newest import Newest
from cell.view.now import Line, Tone
from cell.view.rows import AXIS_HEADING, Axes, Burst, Kind, axis_columns, axis_rows, bursts, duration
from cell.view.words import forced_outputs

MOST_LINES = 60
_AROUND = 8
"""Lines of a program in front of the present one, and behind it."""
_KINDS = {Kind.SILENT: "#64748b", Kind.SIMULATED: "#0284c7", Kind.REAL: "#b91c1c"}
_TONES = {Tone.MOVES: "#16a34a", Tone.WAITS: "#d97706", Tone.STANDS: "#64748b", Tone.ALARM: "#dc2626"}
_DRIVES = _TONES | {Tone.MOVES: "inherit"}
_SEVERITIES = {Severity.INFO: "#64748b", Severity.WARNING: "#d97706", Severity.ALARM: "#dc2626"}
_ZONES = {
    ZoneState.FREE: "#16a34a",
    ZoneState.GRANTED: "#2563eb",
    ZoneState.OCCUPIED: "#d97706",
    ZoneState.ORPHANED: "#dc2626",
}
_BOX = "padding:6px 10px;margin:0 8px 8px;border-radius:6px;font-size:13px;line-height:1.45"


def header(settings: CellSettings, seen: Newest) -> str:
    """The cell, whether machines move, and what concerns all: a stop and who has confirmed it, silence."""
    kind = Kind.of(seen)
    badge = _badge(kind.value, _KINDS[kind])
    manager = seen.one(ManagerState)
    lines = [f"<div style='{_BOX}'><b style='font-size:15px'>{escape(settings.name)}</b> {badge}</div>"]
    if manager is None:
        lines.append(_banner(f"the manager does not answer: cell manager {settings.file}", "#b91c1c"))
    else:
        for estop in manager.estops:
            lines.append(_banner(f"EMERGENCY STOP by {estop.by}: {estop.reason}", "#b91c1c"))
        if manager.estops:
            lines.append(f"<div style='{_BOX}'>{_confirmations(settings, seen)}</div>")
        if manager.setup is not None:
            lines.append(_banner(f"{manager.setup.robot} is in set-up: all others stand", "#d97706"))
    return "".join(lines)


def _confirmations(settings: CellSettings, seen: Newest) -> str:
    """Who stands under the stop, and who has not said so."""
    presences, gateways = seen.of(Presence), seen.of(GatewayState)
    who = {
        f"robot {name}": name in presences and presences[name].estop_acknowledged is not None
        for name in settings.robots
    }
    who |= {
        f"gateway {name}": name in gateways and gateways[name].estop_confirmed is not None for name in settings.gateways
    }
    rows = [
        f"<span style='color:{'#16a34a' if told else '#dc2626'}'>{'&#10003;' if told else '&hellip;'}</span> "
        f"{escape(name)} {'stands' if told else 'has not confirmed'}"
        for name, told in who.items()
    ]
    return "<br>".join(rows)


def now(lines: Iterable[Line]) -> str:
    """One card for each robot."""
    return "".join(map(_card, lines))


def _card(line: Line) -> str:
    colour = _TONES[line.tone]
    since = "" if line.since_s is None else f" <span style='opacity:.7'>(for {duration(line.since_s)})</span>"
    rows = [f"<b>{escape(line.robot)}</b> {_badge(line.mode, colour)}"]
    if line.program:
        rows.append(f"<code style='font-size:12px'>{escape(line.program)}</code>")
    if line.rate:
        rows.append(escape(line.rate))
    if line.reason:
        rows.append(f"<span style='color:{colour}'>{escape(line.reason)}</span>{since}")
    rows.append(f"<b>next:</b> {escape(line.next)}")
    style = f"{_BOX};border-left:5px solid {colour};background:rgba(128,128,128,.10)"
    return f"<div style='{style}'>{'<br>'.join(rows)}</div>"


def drives(settings: CellSettings, seen: Newest, axes: Mapping[str, Axes]) -> str:
    """The axes of all robots, and the buses."""
    return "".join(_drives_of(robot, axes[robot], seen) for robot in settings.robots if robot in axes) + "".join(
        _gateway(name, state) for name, state in sorted(seen.of(GatewayState).items())
    )


def _drives_of(robot: str, axes: Axes, seen: Newest) -> str:
    every = axis_rows(robot, axes, seen)
    columns = axis_columns(every)
    rows = [
        [_coloured(row.cells[i], _DRIVES[row.tone]) if i == 1 else _unbroken(row.cells[i]) for i in columns]
        for row in every
    ]
    heading = [AXIS_HEADING[i] for i in columns]
    feedback = seen.of(DriveFeedback).get(robot)
    state = "silent" if feedback is None else PlayoutState(feedback.state).name.lower()
    return f"<div style='{_BOX}'><b>{escape(robot)}</b> {escape(state)}{table(heading, rows)}</div>"


def _unbroken(text: str) -> str:
    """A number keeps its unit beside it."""
    return escape(text).replace(" ", "&nbsp;")


def _gateway(name: str, state: GatewayState) -> str:
    counters = state.counters
    load = counters.measured_load if counters.measured_load is not None else counters.bus_load
    text = f"{state.interface}, load {100.0 * load:.0f} %, late cycles {counters.late_cycles} of {counters.ticks}"
    ready = _badge("ready", "#16a34a") if state.ready else _badge("not ready", "#dc2626")
    problem = f"<br>{_coloured(state.problem, '#dc2626')}" if state.problem else ""
    inputs = [f"{key} {_on(value)}" for named in state.inputs.values() for key, value in named.items()]
    inputs += [f"{key} {_on(value)}" for node in state.nodes for key, value in node.outputs.items()]
    signals = f"<br>{escape(', '.join(inputs))}" if inputs else ""
    signals += "".join(f"<br>{_coloured(told, '#dc2626')}" for told in forced_outputs(state))
    return f"<div style='{_BOX}'>bus <b>{escape(name)}</b> {ready} {escape(text)}{problem}{signals}</div>"


def _on(value: bool | None) -> str:
    return "unknown" if value is None else "on" if value else "off"


def places(settings: CellSettings, seen: Newest, axes: Mapping[str, Axes]) -> str:
    """Joints of each robot, and its TCP in world and in every frame of the cell, in mm and deg."""
    frames = {name: pose_from(np.array(f.position_m), np.array(f.quaternion_xyzw)) for name, f in _frames(seen)}
    parts = []
    for robot in settings.robots:
        state = seen.of(RobotState).get(robot)
        if state is None or robot not in axes:
            continue
        parts.append(
            f"<div style='{_BOX}'><b>{escape(robot)}</b>{_joints(state, axes[robot])}{_tcp(state, frames)}</div>"
        )
    return "".join(parts)


def _frames(seen: Newest) -> Iterable[tuple[str, FramePose]]:
    return sorted(seen.of(FramePose).items())


def _joints(state: RobotState, axes: Axes) -> str:
    if state.joints is None or len(state.joints) != len(axes.names):
        return table(list(axes.names), [["unknown"] * len(axes.names)])
    values = [
        f"{1000.0 * value:.1f} mm" if sliding else f"{math.degrees(value):.1f}&deg;"
        for value, sliding in zip(state.joints, axes.sliding, strict=True)
    ]
    return table([escape(name) for name in axes.names], [values])


def _tcp(state: RobotState, frames: Mapping[str, Array]) -> str:
    if state.tcp_position_m is None or state.tcp_quaternion_xyzw is None:
        return "TCP unknown"
    pose = pose_from(np.array(state.tcp_position_m), np.array(state.tcp_quaternion_xyzw))
    placed = {"world": pose} | {name: np.linalg.inv(frame) @ pose for name, frame in frames.items()}
    return table(["TCP in", "X", "Y", "Z", "A", "B", "C"], [[escape(name), *_numbers(p)] for name, p in placed.items()])


def _numbers(pose: Array) -> list[str]:
    x, y, z, *turns = to_xyz_abc(pose).tolist()
    return [f"{1000.0 * value:.1f}" for value in (x, y, z)] + [f"{math.degrees(value):.1f}" for value in turns]


def programs(settings: CellSettings, seen: Newest, texts: Mapping[str, tuple[str, ...]]) -> str:
    """Of each robot the lines of its program around the one in execution, as they are in the files here.

    Where the robot has another text at that line, its own line alone is shown: it runs another file, or one that is
    called.
    """
    return "".join(
        f"<div style='{_BOX}'><b>{escape(robot)}</b> {escape(state.program.name)}, {escape(state.program.state.value)}"
        f"<pre style='font-size:12px;margin:4px 0;overflow-x:auto'>{_listing(state, texts.get(robot, ()))}</pre></div>"
        for robot in settings.robots
        if (state := seen.of(RobotState).get(robot)) is not None
    )


def _listing(state: RobotState, lines: tuple[str, ...]) -> str:
    at, text = state.program.line, state.program.text
    here = lines[at - 1].split(";")[0].strip() if 0 < at <= len(lines) else ""
    if at == 0:
        shown = list(enumerate(lines[: 2 * _AROUND], 1))
    elif here and (here in text or text in here):
        first = max(0, at - 1 - _AROUND)
        shown = list(enumerate(lines[first : at + _AROUND], first + 1))
    else:
        shown = [(at, text)]
    marked = f"background:{_TONES[Tone.MOVES]};color:#fff"
    return "\n".join(
        f"<span style='{marked if number == at else ''}'>{number:>5}  {escape(line)}</span>" for number, line in shown
    )


def cell(seen: Newest) -> str:
    """Zones with who has them, who waits and why; meetings; who waits for each other; what is said of lost robots."""
    manager = seen.one(ManagerState)
    if manager is None:
        return f"<div style='{_BOX}'>the manager does not answer</div>"
    zones = [
        [
            escape(name),
            _coloured(zone.state.value, _ZONES[zone.state]),
            escape(zone.holder or ""),
            escape(", ".join(zone.queue)),
            escape(zone.reason) or f"for {duration(max(0.0, manager.cell_time - zone.since))}",
        ]
        for name, zone in manager.zones.items()
    ]
    text = table(["zone", "is", "holder", "waits", "why"], zones) if zones else "no zones<br>"
    for deadlock in manager.deadlocks:
        text += _banner(f"{deadlock.text}; {deadlock.remedy}", "#b91c1c")
    for robot, reason in manager.refused.items():
        text += f"no grants for {escape(robot)}: {escape(reason)}<br>"
    for name, meeting in manager.meetings.items():
        missing = ", ".join(f"{robot}: {what}" for robot, what in meeting.missing.items())
        there = ", ".join(meeting.there)
        text += f"meeting {escape(name)}: {escape(f'{there} wait for {missing}' if there else 'nobody waits')}<br>"
    return f"<div style='{_BOX}'>{text}</div>"


def events(kept: Iterable[tuple[Count, Arrived]], least: Severity, now_s: float) -> str:
    """The newest events of this severity or more, newest first, each with cause and remedy; bursts are one."""
    severities = tuple(Severity)
    chosen = [
        (each.message, each.at)
        for _, each in reversed(list(kept))
        if isinstance(each.message, Event) and severities.index(each.message.severity) >= severities.index(least)
    ]
    rows = [_event(burst, now_s) for burst in islice(bursts(chosen), MOST_LINES)]
    return f"<div style='{_BOX}'>{table(['', ''], rows) if rows else 'nothing since this page was started'}</div>"


def _event(burst: Burst, now_s: float) -> list[str]:
    event = burst.newest
    remedy = f"<br><i>{escape(event.remedy)}</i>" if event.remedy else ""
    told = (
        f"<b>{escape(event.source)}</b> <code>{escape(event.code)}</code>{burst.lasted}<br>{escape(event.text)}{remedy}"
    )
    when = f"<span style='white-space:nowrap'>{duration(now_s - burst.at)} ago</span>"
    return [f"{when}<br>{_coloured(event.severity.value, _SEVERITIES[event.severity])}", told]


def table(heading: list[str], rows: Iterable[list[str]]) -> str:
    """Cells are HTML already."""
    cell_style = "padding:1px 6px 1px 0;vertical-align:top;white-space:normal"
    head = "".join(
        f"<th style='{cell_style};text-align:left;opacity:.7;font-weight:500'>{each}</th>" for each in heading
    )
    body = "".join("<tr>" + "".join(f"<td style='{cell_style}'>{each}</td>" for each in row) + "</tr>" for row in rows)
    style = "border-collapse:collapse;font-size:12px;font-variant-numeric:tabular-nums;width:100%"
    return f"<table style='{style}'><tr>{head}</tr>{body}</table>"


def _badge(text: str, colour: str) -> str:
    style = f"background:{colour};color:#fff;border-radius:4px;padding:1px 7px;font-size:12px;font-weight:600"
    return f"<span style='{style}'>{escape(text)}</span>"


def _banner(text: str, colour: str) -> str:
    return f"<div style='{_BOX};background:{colour};color:#fff;font-weight:600'>{escape(text)}</div>"


def _coloured(text: str, colour: str) -> str:
    return f"<span style='color:{colour}'>{escape(text)}</span>"


def note(*lines: str, room: int = 1) -> str:
    """A few lines of plain text, with room for so many, so that what is below stays where it is."""
    return f"<div style='{_BOX};min-height:{1.45 * room:.2f}em'>{'<br>'.join(map(escape, lines))}</div>"
