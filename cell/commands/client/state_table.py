"""The table that `cell up` and `cell status` show, and the same as plain lines."""

from collections.abc import Iterable
from textwrap import wrap

from rich.text import Text

from cell.commands.client.cell_view import Snapshot, unreferenced
from cell.config.settings import CellSettings
from cell.messages import GatewayState, ManagerState, MeetingStatus, Mode, ProgramState, RobotState, ZoneState
from cell.messages.manager_state import ZoneStatus

LONGEST_PROGRAM_TEXT = 48
SHORTEST_PROGRAM_TEXT = 13
ALARMED = frozenset({Mode.FAULT, Mode.ESTOP})
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
    lost = unreferenced(seen)
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


def program_text(state: RobotState) -> str:
    """The program line being executed, or the program's name and state when there is none."""
    program = state.program
    return program.text or f"{program.name} ({program.state.value})"


def why(state: RobotState) -> str:
    """Why the robot does not move as planned: alarms first, then the program's error, then what it waits for."""
    longest_first = sorted(dict.fromkeys(state.alarms), key=len, reverse=True)
    told = [alarm for i, alarm in enumerate(longest_first) if not any(alarm in longer for longer in longest_first[:i])]
    waiting = state.waiting_for if state.mode is Mode.RETURNING else ""
    return "; ".join(told) or waiting or state.program.error or state.waiting_for


def labelled_why(state: RobotState) -> str:
    """`why` with what it is in front of it, so that waiting does not look like an alarm; then what else is unusual."""
    reason = why(state)
    labelled = f"{_label(state, reason)}: {reason}" if reason else ""
    told = labelled, pace_text(state), mounted_text(state), forced_text(state), virtual_text(state), set_text(state)
    return "; ".join(filter(None, told))


def waited_text(state: RobotState) -> str:
    """How long the program has waited at its WAIT DI, IF or M; empty elsewhere."""
    waits_s = state.program.waits_s
    return f" (since {waits_s:.0f} s)" if waits_s is not None and state.waiting_for else ""


def _label(state: RobotState, reason: str) -> str:
    if reason == state.program.error and state.mode not in ALARMED:
        return "program interrupted" if state.program.state is ProgramState.INTERRUPTED else "program ended"
    return "waits" if reason == state.waiting_for else "alarm"


def pace_text(state: RobotState) -> str:
    """What an operator has set and who rules the rate of a running robot; empty when it simply follows its plan."""
    pace, governor = state.pace, state.governor
    parts = [f"override {100.0 * pace.override:.0f} %"] if pace.override != 1.0 else []
    parts += ["manual"] if pace.manual else []
    parts += ["step"] if pace.stepping else []
    if state.mode is Mode.RUNNING and governor is not None and governor.ruled_by and not state.waiting_for:
        parts.append(f"rate {100.0 * governor.rate:.0f} %, ruled by {governor.ruled_by}")
    return ", ".join(parts)


def mounted_text(state: RobotState) -> str:
    """What the robot holds, or that nobody has said it; empty for nothing."""
    tool = f"tool {state.tool}" if state.tool else ""
    if state.tool is None:
        tool = f"its tool is unknown: cell tool {state.robot}"
    part = f"holds {state.part}" if state.part else ""
    if state.part is None:
        part = f"what it holds is unknown: cell part {state.robot}"
    return ", ".join(filter(None, (tool, part)))


def forced_text(state: RobotState) -> str:
    """What is forced, and to what; empty for nothing."""
    inputs = ", ".join(f"{name} {'on' if on else 'off'}" for name, on in state.forced.items())
    return f"forced for its programs: {inputs}" if inputs else ""


def set_text(state: RobotState) -> str:
    """The parameters that are set; empty for none."""
    values = (f"{name} {each.value:g} {each.unit}" for name, each in state.parameters.items())
    return f"set: {told}" if (told := ", ".join(values)) else ""


def virtual_text(state: RobotState) -> str:
    """What a virtual run does, and why it waits; empty without one."""
    seen = state.virtual
    if seen is None:
        return ""
    waits = f", waits: {seen.waiting_for}" if seen.waiting_for else ""
    return f"virtual run {seen.mode.value}, line {seen.program.line} {seen.program.text or seen.program.name}{waits}"


def virtual_place(state: RobotState) -> str:
    """Where the TCP of a virtual run is; empty without one."""
    position_m = None if state.virtual is None else state.virtual.tcp_position_m
    return "" if position_m is None else f", TCP at {' '.join(f'{1000.0 * value:.1f}' for value in position_m)}"


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
    """How well each robot knows cell time, by which robots start together and leave meetings, and each gateway."""
    clocks = {name: seen.robots[name].clock if name in seen.robots else None for name in settings.robots}
    told = {name: seen.gateways[name].clock if name in seen.gateways else None for name in settings.gateways}
    clocks |= {f"gateway {name}": clock for name, clock in told.items()}
    known = (
        f"{name} {'unknown' if clock is None else f'within {1000 * clock.error_s:.0f} ms'}"
        for name, clock in clocks.items()
    )
    return f"cell time: {', '.join(known)} ({1000 * settings.times.clock_error_s:g} ms allowed)"


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
    )
