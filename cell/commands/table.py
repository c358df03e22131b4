"""The table that `cell up` and `cell status` show, and the same as plain lines."""

from rich.table import Table

from cell.commands.view import Snapshot
from cell.config.settings import CellSettings
from cell.messages import GatewayState, ManagerState, RobotState
from cell.messages.manager_state import ZoneStatus


def cell_table(settings: CellSettings, seen: Snapshot) -> Table:
    """One row per robot: mode, program line, TCP in mm (world), speed in mm/s, zones held, why it waits."""
    table = Table(title=f"cell {settings.name}", title_justify="left", caption="\n".join(footer(settings, seen)))
    table.caption_justify = "left"
    for heading in ("robot", "mode", "line", "program"):
        table.add_column(heading)
    for heading in ("X mm", "Y mm", "Z mm", "mm/s"):
        table.add_column(heading, justify="right")
    table.add_column("zone")
    table.add_column("waits for / alarm", min_width=24)
    for robot in settings.robots:
        state = seen.robots.get(robot)
        table.add_row(
            robot, *(_cells(state) if state is not None else ("silent", *[""] * 7, "its agent does not answer"))
        )
    return table


def _cells(state: RobotState) -> tuple[str, ...]:
    position = state.tcp_position_m
    x, y, z = ("-", "-", "-") if position is None else (f"{1000 * value:.1f}" for value in position)
    speed = "-" if state.tcp_speed_m_s is None else f"{1000 * state.tcp_speed_m_s:.0f}"
    return (
        state.mode.value,
        str(state.program.line),
        program_text(state),
        x,
        y,
        z,
        speed,
        " ".join(state.zones),
        why(state),
    )


def program_text(state: RobotState) -> str:
    """The program line being executed, or the program's name and state when there is none."""
    program = state.program
    return program.text or f"{program.name} ({program.state.value})"


def why(state: RobotState) -> str:
    """Why the robot does not move as planned: alarms first, then the program's error, then what it waits for."""
    longest_first = sorted(dict.fromkeys(state.alarms), key=len, reverse=True)
    told = [alarm for i, alarm in enumerate(longest_first) if not any(alarm in longer for longer in longest_first[:i])]
    return "; ".join(told) or state.program.error or state.waiting_for


def robot_line(robot: str, state: RobotState | None) -> str:
    """A robot in one line, for output that is not a terminal; changes only when something worth a line happens."""
    if state is None:
        return f"{robot}: silent"
    text = f"{robot}: {state.mode.value}, line {state.program.line} {program_text(state)}"
    return f"{text}, waits: {reason}" if (reason := why(state)) else text


def footer(settings: CellSettings, seen: Snapshot) -> list[str]:
    """Zones, gateways and the manager, one line each."""
    lines = [manager_line(settings, seen.manager)]
    zones = seen.manager.zones if seen.manager else {}
    lines += [zone_line(name, zone) for name, zone in zones.items()]
    lines += [gateway_line(name, seen.gateways.get(name)) for name in settings.gateways]
    return lines


def manager_line(settings: CellSettings, manager: ManagerState | None) -> str:
    if manager is None:
        return f"manager: silent at {settings.manager_endpoint}"
    line = f"manager: epoch {manager.epoch}"
    if manager.estop is not None and manager.estop.active:
        line += f", EMERGENCY STOP by {manager.estop.by}: {manager.estop.reason}"
    refused = "".join(f", no grants for {robot}: {reason}" for robot, reason in manager.refused.items())
    return line + refused


def zone_line(name: str, zone: ZoneStatus) -> str:
    line = f"zone {name}: {zone.state.value}"
    if zone.holder is not None:
        line += f" by {zone.holder}"
    if zone.queue:
        line += f", next {', '.join(zone.queue)}"
    return f"{line} ({zone.reason})" if zone.reason else line


def gateway_line(name: str, gateway: GatewayState | None) -> str:
    if gateway is None:
        return f"gateway {name}: silent"
    counters = gateway.counters
    return (
        f"gateway {name}: {'ready' if gateway.ready else gateway.problem or 'not ready'}, {gateway.interface}, "
        f"bus load {100 * counters.bus_load:.0f} %, late cycles {counters.late_cycles} of {counters.ticks}"
    )
