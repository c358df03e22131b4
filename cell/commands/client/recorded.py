"""What of a cell is recorded: all that it says, and the files of this computer that tell what it is."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from cell.config import ConfigError
from cell.config.settings import CellSettings
from cell.messages import STATES, DriveFeedback, PlannedWay, Presence, SetpointBlock
from cell.net.session import CellSession
from robot_agent.model import load_description

if TYPE_CHECKING:
    from cell.recording.cell_files import RecordedCell


_BULK = (DriveFeedback, PlannedWay, Presence, SetpointBlock)
"""Nearly all bytes that a cell says."""


def hear_all(session: CellSession, bulk: CellSession, store: Callable[[str, bytes], None]) -> None:
    """Hand every payload of the cell to `store`, with its key.

    The large streams come through a session of their own: on a busy computer they fill their link, and what does not
    fit is dropped; events and states must not be among it.
    """
    for link, kinds in ((bulk, _BULK), (session, [kind for kind in STATES if kind not in _BULK])):
        for kind in kinds:
            link.hear(link.keys.prefix + STATES[kind].everybodys, store)


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
