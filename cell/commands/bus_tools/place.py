"""Which bus a tool is to work on, and which of its nodes: by a cell file, by a drives file, or by options alone."""

import functools
import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from cell.commands.access import require
from cell.commands.client.cell_files import running_cell
from cell.commands.client.cell_view import names
from cell.commands.errors import CommandError, quoted
from cell.config import ConfigError, load_cell_alone
from cell.config.document import read_document
from cell.config.settings import CellSettings
from cell.view.gate import Level
from drive_gateway.canopen.eds import Eds, ObjectEntry
from drive_gateway.canopen.emcy import Meaning
from drive_gateway.canopen.io_map import DIGITAL_INPUTS, DIGITAL_OUTPUTS, ERROR_MODE, ERROR_VALUE, IO_EDS
from drive_gateway.config import AxisSettings, GatewaySettings, load_drives
from drive_gateway.config.known_drive import eds_of
from drive_gateway.config.settings import BusSettings, IoSettings

IN_ONE_PROCESS = ("virtual",)
"""Interfaces of python-can whose buses no other process sees."""
BITRATE = 1_000_000
_MINUS = "\N{MINUS SIGN}"
_FILE = Annotated[
    Path | None,
    typer.Argument(metavar="FILE", help="A cell file and its gateway, or a drives file alone; none with --channel."),
]
_GATEWAY = Annotated[str | None, typer.Argument(metavar="GATEWAY", help="Name of the gateway, with a cell file only.")]
_INTERFACE = Annotated[
    str | None,
    typer.Option(
        "--interface", "-i", metavar="NAME", help="Interface of python-can, instead of a file; socketcan without it."
    ),
]
_CHANNEL = Annotated[
    str | None, typer.Option("--channel", "-c", metavar="NAME", help="Channel of the interface, such as can0.")
]
_BITRATE = Annotated[
    int | None,
    typer.Option(
        "--bitrate", "-b", metavar="BIT/S", min=10_000, max=1_000_000, help=f"Of the bus; {BITRATE} without it."
    ),
]
_WHERE: dict[str, Any] = {"file": _FILE, "gateway": _GATEWAY}
_OPTIONS: dict[str, Any] = {"interface": _INTERFACE, "channel": _CHANNEL, "bitrate": _BITRATE}
_NAME_A_BUS = "name a cell file and one of its gateways, or a drives file alone, or --channel (and --interface)"

NodeArgument = Annotated[
    str, typer.Argument(metavar="NODE", help="Node-ID, ROBOT.AXIS such as left.J1, or an I/O node.")
]
EdsOption = Annotated[
    Path | None,
    typer.Option(
        "--eds", metavar="FILE", help="EDS or DCF of the node, instead of the axis' own or plain CiA 402 or 401."
    ),
]


@dataclass(frozen=True, slots=True)
class BusPlace:
    """One CAN bus, and what files say of it."""

    bus: BusSettings
    drives: GatewaySettings | None = None
    """What its drives file says; `None`: no file was named."""
    file: Path | None = None
    cell: CellSettings | None = None
    """Whose gateway masters it; `None`: no cell file was named."""

    @property
    def name(self) -> str:
        """Of its gateway, as far as a file says it."""
        return self.drives.name if self.drives else self.bus.channel

    @property
    def in_one_process(self) -> bool:
        """No other process can open the bus."""
        return self.bus.interface in IN_ONE_PROCESS

    @property
    def axes(self) -> list[tuple[str, AxisSettings]]:
        """Every axis of the drives file, as `left.J1`."""
        robots = {} if self.drives is None else self.drives.robots
        return [(f"{name}.{axis.name}", axis) for name, robot in robots.items() for axis in robot.axes]

    @property
    def io_nodes(self) -> tuple[IoSettings, ...]:
        """Every I/O node of the drives file."""
        return () if self.drives is None else self.drives.io_nodes

    @property
    def node_ids(self) -> list[int]:
        """Every node of the drives file, drives first."""
        return [*dict.fromkeys(axis.node_id for _, axis in self.axes), *(io.node_id for io in self.io_nodes)]

    def label(self, node_id: int) -> str:
        """A node for people, with what the file says it is."""
        axes = [label for label, axis in self.axes if axis.node_id == node_id]
        named = ", ".join([*axes, *(f"I/O {io.name}" for io in self.io_nodes if io.node_id == node_id)])
        return f"node {node_id} ({named})" if named else f"node {node_id}"

    def command(self, words: str, rest: str = "") -> str:
        """A command of the gateway's cell, to be recommended; without a cell file with names to be filled in."""
        where = f"{quoted(self.file)} {self.drives.name}" if self.file and self.cell and self.drives else "CELL GATEWAY"
        return f"drive-gateway {words} {where} {rest}".rstrip()


@dataclass(frozen=True, slots=True)
class MeantNode:
    """A node of the bus, whether or not a file names it."""

    id: int
    axis: int
    """Which axis of it was meant, 1 to 3."""
    label: str
    eds: Eds
    settings: AxisSettings | None = None
    """What the drives file says of that axis."""
    io: IoSettings | None = None
    """What the drives file says of that I/O node."""

    @property
    def emergencies(self) -> Mapping[int, Meaning]:
        """What the drives file says of its emergency codes."""
        of = self.settings or self.io
        return {} if of is None else of.emergencies

    @property
    def readable(self) -> list[ObjectEntry]:
        """All its parameters but domains."""
        longest = {} if self.io is None else _longest(self.io)
        entries = [entry for entry in self.eds if entry.readable and not entry.domain]
        return [entry for entry in entries if entry.sub <= longest.get(entry.index, entry.sub)]


def meant_node(place: BusPlace, text: str, eds: Path | None = None) -> MeantNode:
    """The node that a Node-ID, `ROBOT.AXIS` or the name of an I/O node means.

    Raises `CommandError`, and `EdsError` for its file.
    """
    axes = place.axes
    for label, axis in axes:
        if text == label or (text == str(axis.node_id) and axis.number == 1):
            count = sum(other.node_id == axis.node_id for _, other in axes)
            described = eds_of(axis.eds if eds is None else str(eds), count, axis.like)
            return MeantNode(axis.node_id, axis.number, place.label(axis.node_id), described, axis)
    for io in place.io_nodes:
        if text in (io.name, str(io.node_id)):
            return MeantNode(io.node_id, 1, place.label(io.node_id), io_eds(eds), io=io)
    if re.fullmatch(r"[0-9]{1,3}", text) and 1 <= int(text) <= 127:
        return MeantNode(int(text), 1, f"node {int(text)}", Eds("" if eds is None else str(eds)))
    named = [(axis.node_id, label) for label, axis in axes] + [(io.node_id, f"I/O {io.name}") for io in place.io_nodes]
    known = ", ".join(f"{number} ({label})" for number, label in named)
    where = f" on the bus of gateway {place.name}" if place.drives else ""
    also = f"; its nodes are {known}, others have their Node-ID" if known else ""
    raise CommandError(f"no node {text!r}{where}{also}", "a Node-ID is 1 to 127", 2)


def io_eds(file: Path | None = None) -> Eds:
    """The objects of an I/O node: those of a file, or those that CiA 401 has."""
    return Eds(str(files("drive_gateway.sim").joinpath(IO_EDS)) if file is None else str(file))


def _longest(io: IoSettings) -> dict[int, int]:
    """Highest sub-index of objects that the EDS of CiA 401 shows longer than the node has them."""
    return {DIGITAL_INPUTS: io.input_bytes} | dict.fromkeys((DIGITAL_OUTPUTS, ERROR_MODE, ERROR_VALUE), io.output_bytes)


def place_of(
    file: Path | None, gateway: str | None, interface: str | None, channel: str | None, bitrate: int | None
) -> BusPlace:
    """The bus that a command line names.

    Raises:
        CommandError: none is named, or there is no such file or gateway.
        ConfigError: with every problem of a file.
    """
    if file is None:
        if channel is None:
            found = "no bus is named" if interface is None else f"--interface {interface} without --channel"
            raise CommandError(found, _NAME_A_BUS, 2)
        return BusPlace(BusSettings(interface or "socketcan", channel, bitrate or BITRATE, {}))
    if bitrate is not None:
        raise CommandError("--bitrate beside a file, which says it", "leave it out, or name the bus by --channel", 2)
    if gateway is None:
        drives = _drives_alone(file)
        return BusPlace(drives.bus, drives, file)
    cell = running_cell(file)
    if gateway not in cell.gateways:
        raise CommandError(f"no gateway {gateway!r} in {file}; its gateways are: {names(cell.gateways)}")
    drives = load_drives(cell.gateways[gateway].drives, gateway)
    return BusPlace(drives.bus, drives, file, cell)


def _drives_alone(file: Path) -> GatewaySettings:
    """A drives file that no cell file names. Raises `CommandError` for a cell file, `ConfigError` for its problems."""
    if not file.is_file():
        raise CommandError(f"{file}: no such drives file", _NAME_A_BUS)
    try:
        return load_drives(file, file.stem)
    except ConfigError:
        try:
            gateways = load_cell_alone(file).gateways
        except ConfigError:
            pass
        else:
            raise CommandError(f"{file} is a cell file: name one of its gateways, too: {names(gateways)}") from None
        raise


def bus_tool(tool: Callable[..., None], level: Level = Level.WATCH) -> Callable[..., None]:
    """`tool(place, ...)` as a command that takes the words and options of `place_of` instead of the place.

    `level` is that of an account that may use it.
    """
    own = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in _parameters(tool)[1:]]

    @functools.wraps(tool)
    def command(**given: Any) -> None:
        require(level, f"drive-gateway {tool.__name__.replace('_', '-')}")
        place = place_of(*(given.pop(name) for name in (*_WHERE, *_OPTIONS)))
        tool(place, **given)

    added = {name: _optional(name, kind) for name, kind in (_WHERE | _OPTIONS).items()}
    parameters = [*(added[name] for name in _WHERE), *own, *(added[name] for name in _OPTIONS)]
    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return command


def _parameters(tool: Callable[..., None]) -> list[inspect.Parameter]:
    return list(inspect.signature(tool).parameters.values())


def _optional(name: str, kind: Any) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=kind)


class BusCommand(TyperCommand):
    """A command of `bus_tool`: FILE and GATEWAY may be left out before its other words, and numbers may be negative."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        args = [_MINUS + arg[1:] if re.fullmatch(r"-\.?\d.*", arg) else arg for arg in args]
        options, rest, _ = self.make_parser(ctx).parse_args(args=list(args))
        arguments = [str(parameter.name) for parameter in self.params if parameter.param_type_name == "argument"]
        words = [word for name in arguments if isinstance(word := options.get(name), str)] + list(rest)
        if not {*ctx.help_option_names} & {*args}:
            _refuse_missing_file(words, options)
        left_out = _left_out(words, any(isinstance(options.get(name), str) for name in ("interface", "channel")))
        at = len(_WHERE) - left_out
        given = [*words[:at], *[""] * left_out, *words[at:]] if words else []
        remaining: list[str] = super().parse_args(ctx, [*_without(args, words), "--", *given])
        for name in list(_WHERE)[at:]:
            ctx.params[name] = None
        return remaining


def _refuse_missing_file(words: list[str], options: Mapping[str, Any]) -> None:
    named = any(isinstance(options.get(name), str) for name in _OPTIONS)
    if words and not named and not Path(words[0]).is_file():
        raise CommandError(f"{words[0]}: no such cell file or drives file", _NAME_A_BUS, 2)


def _left_out(words: list[str], by_options: bool) -> int:
    """How many of FILE and GATEWAY are not among the words."""
    if by_options:
        return len(_WHERE)
    if not words or not Path(words[0]).is_file():
        return 0
    document, _ = read_document(Path(words[0]))
    return 0 if document is not None and "gateways" in document.keys(()) else 1


def _without(args: list[str], words: list[str]) -> list[str]:
    """The options of a command line: all but its words, which end it where both are the same."""
    kept, left = [], [*words]
    for arg in reversed(args):
        if left and arg == left[-1]:
            left.pop()
        elif arg != "--":
            kept.append(arg)
    return kept[::-1]


def number_text(text: str) -> str:
    """A word of the command line with the minus sign that programs know."""
    return text.replace(_MINUS, "-", 1) if text.startswith(_MINUS) else text


def refuse_virtual(place: BusPlace) -> None:
    """A virtual bus cannot be opened from here: it lives in its gateway's process."""
    if not place.in_one_process:
        return
    if place.cell is None:
        raise CommandError(
            f"the bus {place.bus.channel} is {place.bus.interface}: it lives in its gateway's process",
            "name the cell file and the gateway, so that the gateway is asked",
        )
    raise CommandError(
        f"gateway {place.name} does not run, and its bus {place.bus.channel} is "
        f"{place.bus.interface}: it lives in its process",
        f"start it with: {place.command('run', '--simulate')}",
    )
