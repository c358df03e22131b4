"""The table that `cell up` and `cell status` show, and the same as plain lines."""

from collections.abc import Iterable
from textwrap import wrap

from rich.text import Text

from cell.commands.client.cell_view import Snapshot
from cell.config.settings import CellSettings
from cell.messages import ClockStatus, GatewayState, ManagerState, MeetingStatus, ProgramState, RobotState, ZoneState
from cell.messages.manager_state import ZoneStatus
from cell.view.words import (
    ALARMED,
    forced_outputs,
    forced_text,
    mounted_text,
    pace_text,
    program_text,
    set_text,
    unreferenced,
    virtual_place,
    virtual_text,
    waited_text,
    why,
)

LONGEST_PROGRAM_TEXT = 48
SHORTEST_PROGRAM_TEXT = 13
_HOLDER = {ZoneState.GRANTED: " to", ZoneState.ORPHANED: ", last held by"}


def cell_table(settings: CellSettings, seen: Snapshot, width: int) -> Text:
    """Two lines per robot, then zones, gateways and the manager; always the same number of lines, so nothing jumps.

    The first line has mode, program line, TCP in mm (world), speed in mm/s and the zones that are held, and is cut to
    `width` characters; the second says why the robot waits.
    """
    robots = max(len("robot"), *map(len, settings.robots))
    zones = max([len("zone"), *map(len, settings.zones)])
    numbers = "{:>8} {:>8} {:>8} {:>5}"
    room = width - len(f"{'':{robots}}  {'':9}  {'':4}  " + numbers.format("", "", "", "") + f"   {'':{zones}}")
    room = max(SHORTEST_PROGRAM_TEXT, min(LONGEST_PROGRAM_TEXT, room))

    def row(robot: str, mode: str, line: str, program: str, xyz: Iterable[str], speed: str, held: str) -> str:
        program = program if len(program) <= room else program[: room - 1] + "…"
        row = f"{robot:{robots}}  {mode:9}  {line:>4}  {program:{room}} {numbers.format(*xyz, speed)}  {held}"
        return row.rstrip()

    heading = row("robot", "mode", "line", "program", ("X mm", "Y mm", "Z mm"), "mm/s", "zone")
    text = Text.assemble((f"cell {settings.name}\n", "bold"), (heading, "underline"), "\n")
    lost = unreferenced(seen.gateways.values())
    for robot in settings.robots:
        state = seen.robots.get(robot)
        cells = _cells(state, robot not in lost)
        text.append(row(robot, *cells) + "\n", "bold red" if state is None or state.mode in ALARMED else "")
        reason = "its agent does not answer"
        if state is not None:
            reason = labelled_why(state) + waited_text(state) + virtual_place(state)
        if robot in lost and not reason:
            reason = f"not referenced: {lost[robot]}"
        text.append(_indented(reason, robots + 2, width) + "\n", "yellow")
    text.append("\n".join(footer(settings, seen)))
    return text


def _indented(reason: str, indent: int, width: int) -> str:
    """Below the robot's mode; what is longer than a line goes on there."""
    margin = " " * indent
    lines = wrap(reason, width, initial_indent=margin, subsequent_indent=margin, break_on_hyphens=False)
    return "\n".join(lines)


def _cells(state: RobotState | None, placed: bool) -> tuple[str, str, str, Iterable[str], str, str]:
    if state is None:
        return "silent", "", "", ("", "", ""), "", ""
    position = state.tcp_position_m
    xyz = ("-", "-", "-") if position is None or not placed else tuple(f"{1000 * value:.1f}" for value in position)
    speed = "-" if state.tcp_speed_m_s is None else f"{1000 * state.tcp_speed_m_s:.0f}"
    return state.mode.value, str(state.program.line), program_text(state), xyz, speed, " ".join(state.zones)


def labelled_why(state: RobotState) -> str:
    """`why` with what it is in front of it, so that waiting does not look like an alarm; then what else is unusual."""
    reason = why(state)
    labelled = f"{_label(state, reason)}: {reason}" if reason else ""
    told = labelled, pace_text(state), mounted_text(state), forced_text(state), virtual_text(state), set_text(state)
    return "; ".join(filter(None, told))


def _label(state: RobotState, reason: str) -> str:
    if reason == state.program.error and state.mode not in ALARMED:
        return "program interrupted" if state.program.state is ProgramState.INTERRUPTED else "program ended"
    return "waits" if reason == state.waiting_for else "alarm"


def robot_line(robot: str, state: RobotState | None) -> str:
    """A robot in one line, for output that is not a terminal; changes only when something worth a line happens."""
    if state is None:
        return f"{robot}: silent"
    text = f"{robot}: {state.mode.value}, line {state.program.line} {program_text(state)}"
    return f"{text}, {reason}" if (reason := labelled_why(state)) else text


def footer(settings: CellSettings, seen: Snapshot) -> list[str]:
    """The manager, cell time, zones, meetings and gateways, one line each."""
    lines = [manager_line(settings, seen.manager), clock_line(settings, seen)]
    zones = seen.manager.zones if seen.manager else {}
    lines += [zone_line(name, zone) for name, zone in zones.items()]
    meetings = seen.manager.meetings if seen.manager else {}
    lines += [meeting_line(name, meeting) for name, meeting in meetings.items()]
    lines += [gateway_line(name, seen.gateways.get(name)) for name in settings.gateways]
    return lines


def manager_line(settings: CellSettings, manager: ManagerState | None) -> str:
    if manager is None:
        return f"manager: silent at {settings.manager_endpoint}"
    line = f"manager: epoch {manager.epoch}"
    line += "".join(f", EMERGENCY STOP by {estop.by}: {estop.reason}" for estop in manager.estops)
    if manager.setup is not None:
        line += f", {manager.setup.robot} is in set-up" + (f" ({manager.setup.reason})" if manager.setup.reason else "")
    line += "".join(f", {robot} waits for set-up: {reason}" for robot, reason in manager.setup_refused.items())
    for robot, word in manager.assured.items():
        stays = "stands where it was last known" if word.box is None else "stays in a box"
        line += f", {robot} {stays}, says {word.by}"
    refused = "".join(f", no grants for {robot}: {reason}" for robot, reason in manager.refused.items())
    return line + refused


def zone_line(name: str, zone: ZoneStatus) -> str:
    line = f"zone {name}: {zone.state.value}"
    if zone.holder is not None:
        line += f"{_HOLDER.get(zone.state, ' by')} {zone.holder}"
    if zone.queue:
        line += f", next {', '.join(zone.queue)}"
    return f"{line} ({zone.reason})" if zone.reason else line


def clock_line(settings: CellSettings, seen: Snapshot) -> str:
    """What each process takes for cell time, and how well: by it robots start together and leave meetings."""
    clocks = {name: seen.robots[name].clock if name in seen.robots else None for name in settings.robots}
    told = {name: seen.gateways[name].clock if name in seen.gateways else None for name in settings.gateways}
    clocks |= {f"gateway {name}": clock for name, clock in told.items()}
    known = (f"{name} {'unknown' if clock is None else _offset(clock)}" for name, clock in clocks.items())
    return f"cell time less own clock: {', '.join(known)} ({1e3 * settings.times.clock_error_s:g} ms allowed)"


def _offset(clock: ClockStatus) -> str:
    return f"{clock.offset_s:+.3f} s within {1e3 * clock.error_s:.0f} ms"


def meeting_line(name: str, meeting: MeetingStatus) -> str:
    if not meeting.there:
        return f"meeting {name}: nobody waits"
    waits = "waits" if len(meeting.there) == 1 else "wait"
    missing = ", ".join(f"{robot}, {what}" for robot, what in meeting.missing.items())
    return f"meeting {name}: {', '.join(meeting.there)} {waits} for {missing}"


def gateway_line(name: str, gateway: GatewayState | None) -> str:
    if gateway is None:
        return f"gateway {name}: silent"
    counters = gateway.counters
    return (
        f"gateway {name}: {'ready' if gateway.ready else gateway.problem or 'not ready'}, {gateway.interface}, "
        f"bus load {100 * counters.bus_load:.0f} %, late cycles {counters.late_cycles} of {counters.ticks}"
        f"{''.join(f', {text}' for text in forced_outputs(gateway))}"
    )
