"""`cell drives`: every drive of a running cell, once."""

from collections.abc import Mapping
from pathlib import Path

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from cell.commands.client.cell_view import Snapshot, names
from cell.commands.client.connection import connect
from cell.commands.client.json_lines import json_line
from cell.commands.client.state_table import gateway_line
from cell.commands.errors import CommandError, quoted
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, JsonOption
from cell.config.settings import CellSettings
from cell.messages import GatewayState, IoStatus, NodeStatus


def drives(as_json: JsonOption = False, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Show every drive and I/O node once: NMT, drive state, inputs and outputs, emergencies, counters of the bus.

    Exits with 1 when a gateway is silent or not ready.
    """
    with connect(file, endpoint) as operator:
        seen = operator.snapshot()
        if as_json:
            print(*drive_lines(operator.settings, seen), sep="\n")
        else:
            Console().print(drives_table(operator.settings, seen))
        unready = [
            name for name in operator.settings.gateways if name not in seen.gateways or not seen.gateways[name].ready
        ]
        if unready:
            raise CommandError(
                f"silent or not ready: gateway {names(unready)}",
                f"start it with: drive-gateway run {quoted(file)} GATEWAY; or correct what its line above says",
            )


def drives_table(settings: CellSettings, seen: Snapshot) -> Table:
    """One row per axis and I/O node of all gateways that are heard; below, named inputs and one line per bus."""
    heard = [gateway for name in settings.gateways if (gateway := seen.gateways.get(name)) is not None]
    counters = [f"inputs of {robot}: {inputs_text(named)}" for each in heard for robot, named in each.inputs.items()]
    counters += [bus_line(name, seen.gateways.get(name)) for name in settings.gateways]
    title, caption = f"drives of cell {settings.name}", "\n".join(counters)
    table = Table(title=title, title_justify="left", caption=caption, box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.caption_justify = "left"
    for heading in ("gateway", "node", "axis", "NMT", "drive", "error\nmrad/mm", "A", "°C", "trouble"):
        table.add_column(heading, overflow="fold", no_wrap=heading in ("axis", "NMT"))
    for name in settings.gateways:
        gateway = seen.gateways.get(name)
        for node in gateway.nodes if gateway is not None else ():
            measured = following_error(node), _number(node.current_a, 2), _number(node.temperature_c, 0)
            words = (node.nmt, drive_text(node), *measured, trouble(node))
            table.add_row(name, str(node.node_id), f"{node.robot} {node.axis}", *words)
        for io in gateway.io_nodes if gateway is not None else ():
            table.add_row(
                name, str(io.node_id), f"I/O {io.name}", io.nmt, io_text(io), "", "", "", emergency(io) or io.problem
            )
    return table


def drive_lines(settings: CellSettings, seen: Snapshot) -> list[str]:
    """The gateways with what they count, their axes and I/O nodes, for programs."""
    lines = []
    for name in settings.gateways:
        gateway = seen.gateways.get(name)
        lines.append(json_line("gateway", name, gateway, silent=gateway is None))
        for node in gateway.nodes if gateway is not None else ():
            lines.append(json_line("drive", f"{node.robot}/{node.axis}", node, gateway=name))
        for io in gateway.io_nodes if gateway is not None else ():
            lines.append(json_line("io_node", io.name, io, gateway=name))
    return lines


def inputs_text(named: Mapping[str, bool | None]) -> str:
    """Digital inputs by name; one that nobody has measured lately is unknown."""
    words = {True: "on", False: "off", None: "unknown"}
    return ", ".join(f"{name} {words[value]}" for name, value in named.items())


def io_text(io: IoStatus) -> str:
    """Whether an I/O node works, and what its outputs were told."""
    outputs = [
        f"{robot} {name} {'on' if on else 'off'}" for robot, all_ in io.outputs.items() for name, on in all_.items()
    ]
    return ", ".join(["works" if io.operational else "does not work", *outputs])


def emergency(node: NodeStatus | IoStatus) -> str:
    """The newest one that was not acknowledged."""
    return "" if node.emergency_code is None else f"{node.emergency_code:04X}h {node.emergency_text}"


def drive_text(node: NodeStatus) -> str:
    """State, warning and digital outputs of a drive."""
    outputs = [f"{name} {'on' if on else 'off'}" for name, on in node.outputs.items()]
    return ", ".join([node.drive.words, *["warning"] * node.warning, *outputs])


def following_error(node: NodeStatus) -> str:
    """The largest one since the robot was enabled, in mrad of a joint that turns and mm of one that slides."""
    return "" if node.following_error is None else f"{1000.0 * node.following_error:.2f}"


def _number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"


def trouble(node: NodeStatus) -> str:
    """The newest emergency that was not acknowledged, and why the axis is not referenced."""
    reference = "" if node.referenced else f"not referenced: {node.reference_missing}"
    return "; ".join(filter(None, (emergency(node), reference)))


def bus_line(name: str, gateway: GatewayState | None) -> str:
    """What a gateway counts."""
    line = gateway_line(name, gateway)
    if gateway is None:
        return line
    counters = gateway.counters
    load = "" if counters.measured_load is None else f", measured bus load {100 * counters.measured_load:.0f} %"
    phase = (
        "" if counters.phase_error_s is None else f", SYNC {1e6 * counters.phase_error_s:+.0f} us off the cell clock"
    )
    return (
        f"{line}{load}{phase}, worst {1000 * counters.worst_lateness_s:.1f} ms, "
        f"missing TPDOs {counters.missing_tpdos}, "
        f"blocks {counters.blocks_accepted} taken {counters.blocks_refused} refused"
    )
