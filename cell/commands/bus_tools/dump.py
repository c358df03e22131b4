"""`drive-gateway dump`: the frames of a bus in words as they come."""

import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from threading import Event
from typing import Annotated, Any

import can
import typer

from cell.commands.bus_tools.frame_text import FrameReader, Kind
from cell.commands.bus_tools.place import BusPlace
from cell.commands.errors import CommandError
from cell.commands.processes.stop import stop_event
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.gateway.bus.bus_news import remedy_of
from drive_gateway.gateway.bus.opening import BusError, open_bus
from drive_gateway.gateway.bus.recorder import FORMATS

_POLL_S = 0.1


def dump(
    place: BusPlace,
    node: Annotated[
        list[int] | None, typer.Option("--node", "-n", min=1, max=127, help="Frames of this node only; repeatable.")
    ] = None,
    kind: Annotated[
        list[Kind] | None, typer.Option("--kind", "-k", help="Frames of this kind only; may be repeated.")
    ] = None,
    changed: Annotated[
        bool, typer.Option("--changed", help="A frame only when its data differ from the one before.")
    ] = False,
    seconds: Annotated[
        float | None, typer.Option("--seconds", "-s", min=0.1, help="How long; until Ctrl-C without it.")
    ] = None,
    recorded: Annotated[
        Path | None,
        typer.Option("--log", metavar="LOG", help=f"Frames of this file instead: {', '.join(FORMATS)} (see `log`)."),
    ] = None,
) -> None:
    """Show the frames of a bus in words, as they come; nothing is ever sent, so it may run beside a gateway.

    Identifiers are those of CiA 301. With a drives file the contents of its PDOs are shown by their mapping, objects by
    the names of their EDS, and the maker's emergency codes with their meaning. `--changed` leaves out SYNC, heartbeats
    and set points that stay the same. A virtual bus lives in its gateway's process: record it by `log`, then read it
    with `--log`.
    """
    reader = FrameReader(place)
    last: dict[int, bytes] = {}
    frames = _of_file(recorded) if recorded is not None else _of_bus(place, seconds)
    try:
        for message in frames:
            if message.is_extended_id or message.is_error_frame:
                continue
            number, data = message.arbitration_id, bytes(message.data)
            if changed and last.get(number) == data:
                continue
            last[number] = data
            said = reader.read(CanFrame(number, data, message.is_remote_frame))
            if (not node or said.node in node) and (not kind or said.kind in kind):
                print(f"{message.timestamp:.6f}  {number:03X}  {said.text}", flush=True)
    except BrokenPipeError:  # whoever read this has seen enough, such as `head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _of_bus(place: BusPlace, seconds: float | None) -> Iterator[can.Message]:
    """What comes on the bus. Raises `BusError`."""
    if place.in_one_process:
        raise CommandError(
            f"the bus {place.bus.channel} is {place.bus.interface}: it lives in its gateway's process",
            f"record it: {place.command('log', 'bus.log')}; then show it with: dump ... --log bus.log",
        )
    stop = stop_event()
    with open_bus(place.bus) as bus:
        yield from _received(bus, place, stop, seconds)


def _received(bus: can.BusABC, place: BusPlace, stop: Event, seconds: float | None) -> Iterator[can.Message]:
    end = None if seconds is None else time.monotonic() + seconds
    while not stop.is_set() and (end is None or time.monotonic() < end):
        try:
            message = bus.recv(_POLL_S)
        except (can.CanError, OSError) as error:
            raise BusError(place.bus, str(error), remedy_of(place.bus)) from error
        if message is not None:
            yield message


def _of_file(file: Path) -> Iterator[can.Message]:
    """The frames of a recording. Raises `CommandError` where there is none."""
    if file.suffix not in FORMATS:
        raise CommandError(f"{file}: unknown format", f"use one of the suffixes {', '.join(FORMATS)}", 2)
    empty = True
    try:
        with can.LogReader(str(file)) as log:
            messages: Any = iter(log)
            for message in messages:
                empty = False
                yield message
    except Exception as error:  # each format's reader raises errors of its own
        raise CommandError(f"{file} cannot be read: {error}", "name a file that `log` has written") from error
    if empty:
        raise CommandError(f"{file} holds no frame", "name a file that `log` has written on a bus with traffic")
