"""`cell run`, `halt`, `continue`, `enable`, `disable`: an operator's orders to one robot."""

from pathlib import Path

from cell.commands.connection import connect, report
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, RobotArgument
from cell.messages import Command, Continue, Disable, Enable, Halt, Run


def _order(robot: str, command: Command, file: Path, endpoints: list[str] | None) -> None:
    with connect(file, endpoints) as operator:
        report(robot, operator.ask_robot(robot, command))


def run(robot: RobotArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Start a robot's program from its first line."""
    _order(robot, Run(), file, endpoint)


def halt(robot: RobotArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Brake a robot on its path; `cell continue` goes on from there."""
    _order(robot, Halt(), file, endpoint)


def continue_(robot: RobotArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Let a halted robot go on along its path."""
    _order(robot, Continue(), file, endpoint)


def enable(robot: RobotArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Switch a robot's drives on; it holds its position."""
    _order(robot, Enable(), file, endpoint)


def disable(robot: RobotArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Switch a robot's drives off; refused while it moves."""
    _order(robot, Disable(), file, endpoint)
