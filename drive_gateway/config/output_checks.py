"""Whether the digital outputs of a drives file can be switched: the objects of their axes, the RPDO for them."""

from collections.abc import Iterator

from cell.config.document import Document
from cell.config.problem import KeyPath, Problem
from drive_gateway.canopen.axis_objects import index_of
from drive_gateway.canopen.drive_objects import DIGITAL_OUTPUTS
from drive_gateway.canopen.eds import Eds
from drive_gateway.canopen.eds_file import EdsError
from drive_gateway.config.axis_entry import AxisEntry
from drive_gateway.config.drives_file import DrivesFile
from drive_gateway.config.object_address import address_of

MOST_OUTPUTS = 32
"""The feedback tells them in a word."""
_NEEDED = ("60FE:01", "60FE:02")
"""The outputs and their mask, beside an RPDO."""
_USUAL = 3
"""The RPDO of an axis that carries its outputs, unless the file says another one."""


def check_outputs(document: Document, drives: DrivesFile) -> Iterator[Problem]:
    """All contradictions of the outputs with their axes; where each is says `io_checks`."""
    for robot, entry in drives.robots.items():
        path: KeyPath = ("robots", robot, "outputs")
        if len(entry.outputs) > MOST_OUTPUTS:
            yield document.problem(path, f"{len(entry.outputs)} outputs", f"up to {MOST_OUTPUTS}", at_key=True)
        for name in dict.fromkeys(output.axis for output in entry.outputs.values() if output.axis is not None):
            if name in entry.axes:
                yield from _drive(document, ("robots", robot, "axes", name), entry.axes[name], drives)


def _drive(document: Document, path: KeyPath, axis: AxisEntry, drives: DrivesFile) -> Iterator[Problem]:
    """Its third RPDO is free, and its EDS, if there is one, has what is needed."""
    profile = drives.profile_pdos
    said = None if axis.pdos.outputs is None else axis.pdos.outputs.number
    if said is None and profile is not None and (profile.rpdo3 or axis.feed_forward != "none"):
        taken = "profile_pdos.rpdo3" if profile.rpdo3 else "feed_forward beside profile_pdos"
        found = f"outputs, whose RPDO {taken} takes"
        yield document.problem(path, found, "outputs at another axis, or its third RPDO free", at_key=True)
    for address in axis.objects:
        if address_of(address)[0] == index_of(DIGITAL_OUTPUTS, axis.axis):
            found = f"{address} beside outputs of this axis, with which the gateway writes it"
            yield document.problem((*path, "objects", address), found, "one of the two", at_key=True)
    if axis.eds is None:
        return
    try:
        eds = Eds(str(document.beside(axis.eds)), axis.axis)
    except EdsError:
        return  # told where the file is named
    number = (said or _USUAL) - 1
    needed = (*_NEEDED, f"{0x1400 + number:04X}:01", f"{0x1600 + number:04X}:01")
    lacking = [address for address in needed if not eds.find(address).size]
    if lacking:
        found = f"{axis.eds} without {' and '.join(lacking)}, which outputs of this axis need"
        yield document.problem((*path, "eds"), found, "outputs at a drive that has 60FEh and a third RPDO")
