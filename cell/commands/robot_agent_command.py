"""The command `robot-agent`: the process of one robot."""

import logging
import threading
from pathlib import Path

import typer

from cell.commands.client.cell_files import process_cell
from cell.commands.client.cell_view import names
from cell.commands.errors import CommandError, quoted, run_app
from cell.commands.options import (
    CellFileArgument,
    CfgOption,
    ConfigOption,
    ConnectOption,
    ListenOption,
    LogJsonOption,
    ModeOption,
    ParentPipeOption,
    RobotArgument,
    StateDirOption,
    zenoh_options,
)
from cell.commands.processes.process import run_process
from cell.commands.subcommands import explained
from cell.config.problem import ConfigError

app = typer.Typer(
    add_completion=False, pretty_exceptions_enable=False, context_settings={"help_option_names": ["-h", "--help"]}
)


@app.command(epilog="Example: robot-agent cell_configs/two_arms/cell.yaml left")
def robot_agent(
    file: CellFileArgument,
    robot: RobotArgument,
    mode: ModeOption = None,
    connect: ConnectOption = None,
    listen: ListenOption = None,
    config: ConfigOption = None,
    cfg: CfgOption = None,
    state_dir: StateDirOption = None,
    log_json: LogJsonOption = False,
    parent_pipe: ParentPipeOption = None,
) -> None:
    """Run the agent of one robot, until Ctrl-C or SIGTERM; then the robot brakes on its path before the agent ends.

    It claims the robot's drives from its gateway and obeys the operator's commands; nothing moves before
    `cell enable ROBOT` and `cell run ROBOT`.
    """
    from robot_agent.agent.operator.loading import read_program
    from robot_agent.agent.shell import run_agent
    from robot_agent.kinematics import KinematicsError
    from robot_agent.workspace import PlacedRobot

    settings = process_cell(file, parent_pipe)
    if robot not in settings.robots:
        raise CommandError(f"no robot {robot!r} in {file}; its robots are: {names(settings.robots)}")
    mine = settings.robots[robot]
    try:
        placed = PlacedRobot.of(mine)
        program = read_program(settings, robot, placed.model, mine.program)
    except (ConfigError, KinematicsError) as error:
        raise CommandError(str(error), f"correct it, then: cell check {quoted(file)}") from error
    options = zenoh_options(mode, connect, listen, config, cfg)

    def body(folder: Path, stop: threading.Event) -> int:
        say = logging.getLogger("robot_agent").warning
        return run_agent(settings, robot, placed, program, options, folder, stop, say)

    run_process(f"robot-{robot}", settings, state_dir, parent_pipe, log_json, body)


def main() -> None:
    """Run the words of the command line."""
    run_app(lambda: explained(app)(prog_name="robot-agent"), "robot-agent")
