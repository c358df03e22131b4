"""What of a cell is recorded: all that it says, and the files of this computer that tell what it is."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from cell.config import ConfigError
from cell.config.settings import CellSettings
from cell.messages import STATES
from cell.net.bundle import BUNDLED, EVERY_S
from cell.net.session import CellSession
from robot_agent.model import load_description

if TYPE_CHECKING:
    from cell.recording.cell_files import RecordedCell


SETTLE_S = EVERY_S + 0.1
"""What was said so long ago has been heard, if it ever is: bundles come after what was said meanwhile."""


def hear_all(session: CellSession, bulk: CellSession, store: Callable[[str, bytes, float], None]) -> None:
    """Hand every payload of the cell to `store`, with its key and its age [s], not in the order of their ages.

    The large streams come in bundles, and through a session of their own: on a busy computer they fill their link, and
    what does not fit is dropped; events and states must not be among it.
    """
    for kind in STATES:
        if kind not in BUNDLED:
            session.hear(session.keys.prefix + STATES[kind].everybodys, lambda key, payload: store(key, payload, 0.0))
    bulk.hear_bundles(store)


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
