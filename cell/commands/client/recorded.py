"""The cell of a recording, as far as the files of this computer tell it."""

from typing import TYPE_CHECKING

from cell.config import ConfigError
from cell.config.settings import CellSettings
from robot_agent.model import load_description

if TYPE_CHECKING:
    from cell.recording.cell_files import RecordedCell


def recorded(settings: CellSettings) -> "RecordedCell":
    """The files of a cell and the names of its joints; a file with mistakes keeps nothing from being recorded."""
    from cell.recording.cell_files import recorded_cell

    joints = {}
    for name, robot in settings.robots.items():
        try:
            joints[name] = load_description(robot.model).joint_names
        except ConfigError:
            continue
    return recorded_cell(settings, joints)
