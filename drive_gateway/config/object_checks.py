"""Whether the EDS and DCF files of a drives file can be read, and what they and its `objects` say can be written."""

from collections.abc import Iterator, Sequence

from cell.config.document import Document
from cell.config.problem import KeyPath, Problem
from drive_gateway.canopen.eds import Eds
from drive_gateway.canopen.eds_file import EdsError
from drive_gateway.config.axis_entry import AxisEntry
from drive_gateway.config.node_checks import NamedAxis
from drive_gateway.config.own_objects import EdsFiles, dcf_objects, own_object


def check_objects(document: Document, axes: Sequence[NamedAxis], bitrate: int) -> Iterator[Problem]:
    """Every file, every value, and no object twice on a node."""
    files = EdsFiles()
    seen: dict[tuple[int, tuple[int, int]], str] = {}
    for path, who, axis in axes:
        try:
            eds = files.get("" if axis.eds is None else str(document.beside(axis.eds)), axis.axis, axis.like)
            of_dcf = {(item.index, item.sub) for item in dcf_objects(eds)}
        except EdsError as error:
            yield document.problem((*path, "eds"), error.found, error.allowed)
            continue
        yield from _device(document, path, axis, eds, bitrate)
        for address, value in axis.objects.items():
            place = (*path, "objects", address)
            try:
                item = own_object(address, value, axis.axis, eds)
            except EdsError as error:
                yield document.problem(place, error.found, error.allowed)
                continue
            key = (item.index, item.sub)
            before = seen.get((axis.node, key)) or (
                f"{axis.eds} of axis 1" if axis.axis > 1 and key in of_dcf else None
            )
            seen[axis.node, key] = who
            if before is not None:
                yield document.problem(place, f"{address}, which {before} says too", "each object of a node once")


def _device(document: Document, path: KeyPath, axis: AxisEntry, eds: Eds, bitrate: int) -> Iterator[Problem]:
    """A DCF is for one device: another Node-ID or bit rate in it means that it is that of another one."""
    if eds.node_id not in (None, axis.node):
        yield document.problem((*path, "eds"), f"{axis.eds} for Node-ID {eds.node_id}", f"one for Node-ID {axis.node}")
    if eds.bitrate not in (None, bitrate):
        found = f"{axis.eds} for {eds.bitrate} bit/s"
        yield document.problem((*path, "eds"), found, f"one for this bus, {bitrate} bit/s")
