"""`cell manager`: the process that owns the zones and the emergency stop of one cell."""

import threading
from pathlib import Path

from cell.commands.client.cell_files import process_cell
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


def manager(
    file: CellFileArgument,
    mode: ModeOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    cfg: CfgOption = None,
    state_dir: StateDirOption = None,
    log_json: LogJsonOption = False,
    parent_pipe: ParentPipeOption = None,
) -> None:
    """Run the manager of a cell alone, until Ctrl-C or SIGTERM.

    It listens at the manager's endpoint of the cell file, which is where everybody else finds the cell.
    """
    from cell.manager.shell import run_manager

    settings = process_cell(file, parent_pipe)
    options = zenoh_options(mode, connect, listen, config, cfg)

    def body(folder: Path, stop: threading.Event) -> int:
        return run_manager(settings, options, folder, stop)

    run_process("manager", settings, state_dir, parent_pipe, log_json, body)
