"""What must hold for axes that are `like` a known drive."""

from collections.abc import Iterator, Sequence

from cell.config.document import Document
from cell.config.problem import Problem, Severity
from drive_gateway.canopen.drive_objects import HOME_OFFSET, VELOCITY_OFFSET
from drive_gateway.canopen.eds_file import EdsError
from drive_gateway.config.axis_entry import AxisEntry
from drive_gateway.config.known_drive import UNITS, known_drive
from drive_gateway.config.node_checks import NamedAxis
from drive_gateway.config.own_objects import EdsFiles


def check_known_drives(document: Document, axes: Sequence[NamedAxis]) -> Iterator[Problem]:
    """Each kind is named once as never tried; its units are known or said, and nothing is asked of it that it lacks."""
    told: set[str] = set()
    files = EdsFiles()
    for path, _, axis in axes:
        if axis.like is None:
            continue
        place, known = (*path, "like"), known_drive(axis.like)
        if axis.like not in told:
            told.add(axis.like)
            found = f"{axis.like} ({known.drive}): what its maker's documents say, never tried with this program"
            allowed = "a first motion with care; `drive-gateway check` shows each fact with its source"
            yield document.problem(place, found, allowed, severity=Severity.WARNING)
        for unit in UNITS:
            if unit not in known.keys and document.value((*path, unit)) is None:
                allowed = f"{unit} beside it, from the drive's manual: no document that was found says it"
                yield document.problem(place, f"{axis.like} without {unit}", allowed)
        try:
            eds = None if axis.eds is None else files.get(str(document.beside(axis.eds)), axis.axis)
        except EdsError:
            continue  # told where the file is named
        for index, key in _used(axis):
            if index in known.missing and (eds is None or (index, 0) not in eds):
                found = f"{key}, for which {index:04X}h is written: a drive that has none ({known.missing[index]})"
                allowed = "an `eds` of the drive that has it, or no such key"
                yield document.problem((*path, key), found, allowed, severity=Severity.WARNING)


def _used(axis: AxisEntry) -> Iterator[tuple[int, str]]:
    """Objects without which a key of the axis cannot be fulfilled."""
    if axis.homing is not None:
        yield HOME_OFFSET, "homing"
    if axis.feed_forward != "none":
        yield VELOCITY_OFFSET, "feed_forward"
