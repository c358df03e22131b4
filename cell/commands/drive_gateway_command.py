"""The command `drive-gateway`: the process of one CAN bus, and its simulated drives."""

import threading
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.bus_tools import compare, drive_errors, drive_tools, dump, network_orders, node_setting, plan
from cell.commands.bus_tools.drive_fault import fault
from cell.commands.bus_tools.place import BusCommand, bus_tool
from cell.commands.client.cell_files import process_cell
from cell.commands.client.cell_view import names
from cell.commands.errors import CommandError, run_app
from cell.commands.options import (
    CellFileArgument,
    CfgOption,
    ConfigOption,
    ConnectOption,
    ListenOption,
    LogJsonOption,
    ModeOption,
    ParentPipeOption,
    StateDirOption,
    zenoh_options,
)
from cell.commands.processes.process import run_process
from cell.commands.processes.simulation import robot_loads, simulation_of
from cell.commands.subcommands import explained
from cell.config.settings import CellSettings
from cell.view.gate import Level

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="One CAN bus of a cell: its CANopen master, or simulated drives on it.",
    epilog="Example: drive-gateway run cell_configs/two_arms/cell.yaml left_bus --simulate",
)

GatewayArgument = Annotated[str, typer.Argument(metavar="GATEWAY", help="Name of the gateway in the cell file.")]


@app.command(epilog="Example: drive-gateway run cell_configs/two_arms/cell.yaml left_bus --simulate")
def run(
    file: CellFileArgument,
    gateway: GatewayArgument,
    simulate: Annotated[bool, typer.Option("--simulate", help="Add simulated drives on the same bus.")] = False,
    mode: ModeOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    cfg: CfgOption = None,
    state_dir: StateDirOption = None,
    log_json: LogJsonOption = False,
    parent_pipe: ParentPipeOption = None,
) -> None:
    """Run a gateway: bring the drives of its bus up and play the set points of their robots.

    Ends with Ctrl-C or SIGTERM: what was sent is played to rest, then the drives are switched off. Without `--simulate`
    it moves real machines; an emergency stop over the network supports and never replaces a hard-wired one.
    """
    from cell.net.options import Link
    from drive_gateway.config import load_drives
    from drive_gateway.gateway.shell import run_gateway

    settings = _settings(file, gateway, parent_pipe)
    mine = settings.gateways[gateway]
    drives = load_drives(mine.drives, gateway)
    simulation = simulation_of(settings, gateway) if simulate else None
    robots = {} if simulation is None else robot_loads(settings, gateway, simulation)
    options = zenoh_options(mode, connect, listen, config, cfg)
    link = Link("peer", listen=(mine.endpoint,), connect=(settings.manager_endpoint,))

    def body(folder: Path, stop: threading.Event) -> int:
        return run_gateway(
            drives,
            settings.times,
            cell=settings.name,
            digest=settings.digest,
            link=link,
            stop=stop,
            simulation=simulation,
            robots=robots,
            state_folder=folder,
            zenoh_options=options,
        )

    run_process(f"gateway-{gateway}", settings, state_dir, parent_pipe, log_json, body)


@app.command(epilog="Example: drive-gateway simulate cell_configs/two_arms/cell.yaml left_bus")
def simulate(
    file: CellFileArgument,
    gateway: GatewayArgument,
    state_dir: StateDirOption = None,
    log_json: LogJsonOption = False,
    parent_pipe: ParentPipeOption = None,
) -> None:
    """Run simulated drives alone on a gateway's bus, for a gateway in another process or on another host.

    The bus must be one that several processes can share, for example socketcan (vcan) or udp_multicast.
    """
    from drive_gateway.config import load_drives
    from drive_gateway.sim.shell import run_simulated_drives

    settings = _settings(file, gateway, parent_pipe)
    drives = load_drives(settings.gateways[gateway].drives, gateway)
    simulation = simulation_of(settings, gateway)
    robots = robot_loads(settings, gateway, simulation)

    def body(_folder: Path, stop: threading.Event) -> int:
        return run_simulated_drives(drives, simulation, stop, robots)

    run_process(f"drives-{gateway}", settings, state_dir, parent_pipe, log_json, body)


@app.command(epilog="Example: drive-gateway tune cell_configs/two_arms/cell.yaml left_bus J2")
def tune(
    file: CellFileArgument,
    gateway: GatewayArgument,
    axis: Annotated[str, typer.Argument(metavar="AXIS", help="An axis of the gateway: J1, or left.J1.")],
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="Write the curves to this HTML page too.")
    ] = None,
) -> None:
    """Show step and frequency response of a simulated axis, with its gain margin from the open loop.

    Motor, load and servo loop are those of `axes` in the simulation file beside the drives file. Nothing moves and no
    bus is opened.
    """
    from cell.commands.bus_tools.tune import show_tuning
    from drive_gateway.config import load_drives

    settings = _settings(file, gateway, None)
    drives = load_drives(settings.gateways[gateway].drives, gateway)
    show_tuning(drives, simulation_of(settings, gateway), axis, output)


def _example(words: str) -> str:
    return f"Example: drive-gateway {words}"


_CELL = "cell_configs/two_arms/cell.yaml left_bus"
_DRIVES = "cell_configs/two_arms/left_drives.yaml"
for _tool, _words, _level in (
    (drive_tools.scan, "scan --channel can0 --bitrate 500000", Level.WATCH),
    (drive_tools.read, f"read {_CELL} left.J1 6041:00", Level.WATCH),
    (drive_tools.write, f"write {_CELL} left.J1 6081:00 100000", Level.CONFIGURE),
    (drive_tools.store, f"store {_CELL} left.J1", Level.CONFIGURE),
    (drive_tools.restore, "restore --channel can0 5 --parameters application", Level.CONFIGURE),
    (drive_tools.log, f"log {_CELL} left.asc --seconds 5", Level.WATCH),
    (dump.dump, f"dump {_DRIVES} --kind emcy --kind sdo --node 1", Level.WATCH),
    (drive_errors.errors, f"errors {_DRIVES} left.J1", Level.WATCH),
    (network_orders.nmt, "nmt --channel can0 5 reset-node", Level.CONFIGURE),
    (node_setting.node_id, "node-id --channel can0 5", Level.CONFIGURE),
    (compare.compare, f"compare {_DRIVES} left.J1 --dcf drive.dcf", Level.WATCH),
    (plan.plan, f"plan {_DRIVES} left.J1", Level.WATCH),
    (fault, f"fault {_CELL} left.J1 emcy 5112", Level.CONFIGURE),
):
    app.command(cls=BusCommand, epilog=_example(_words))(bus_tool(_tool, _level))
app.command(epilog=_example(f"check {_DRIVES}"))(plan.check)


def _settings(file: Path, gateway: str, parent_pipe: int | None) -> CellSettings:
    settings = process_cell(file, parent_pipe)
    if gateway not in settings.gateways:
        raise CommandError(f"no gateway {gateway!r} in {file}; its gateways are: {names(settings.gateways)}")
    return settings


def main() -> None:
    """Run the words of the command line."""
    run_app(lambda: explained(app)(prog_name="drive-gateway"), "drive-gateway")
