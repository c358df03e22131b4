"""`drive-gateway fault`: a simulated drive fails, to see what follows."""

from typing import Annotated

import typer

from cell.commands.bus_tools.drive_tools import GatewayArgument, NodeArgument, named_node
from cell.commands.bus_tools.node_access import drives_of, running_gateway
from cell.commands.errors import CommandError, quoted
from cell.commands.options import CellFileArgument
from cell.messages.drive_fault import NEEDS_VALUE, Fault, FaultDrive


def fault(
    file: CellFileArgument,
    gateway: GatewayArgument,
    node: NodeArgument,
    kind: Annotated[Fault, typer.Argument(metavar="FAULT", help=", ".join(Fault) + ".")],
    value: Annotated[
        str | None,
        typer.Argument(
            metavar="[VALUE]", help="Code of emcy in hex (5112), counts of encoder-jump, milliseconds of late-tpdos."
        ),
    ] = None,
    seconds: Annotated[
        float | None, typer.Option("--for", metavar="S", help="Ends after so many seconds. [default: it stays]")
    ] = None,
) -> None:
    """Let a simulated drive fail, also while it moves; refused for drives that are real. An I/O node can drop out.

    The running gateway orders it over the bus: drives of its own process (`--simulate`, `cell up`) and those that run
    alone (`drive-gateway simulate`). What has no end (`--for`) stays until the process of the drives is started again;
    an emcy is over when the drive is reset.
    """
    named = named_node(drives_of(file, gateway), node)
    order = FaultDrive(named.node_id, named.axis, kind, _number(kind, value), seconds)
    with running_gateway(file, gateway) as line:
        if line is None:
            raise CommandError(
                f"gateway {gateway} does not run, and only it orders a fault",
                f"drive-gateway run {quoted(file)} {gateway} --simulate; without --simulate where its drives run alone",
            )
        typer.echo(line.ask(order).text)


def _number(kind: Fault, text: str | None) -> int | None:
    if text is None:
        return None
    try:
        return int(text.removesuffix("h"), 16) if kind is Fault.EMERGENCY else int(text)
    except ValueError as error:
        allowed = "a code in hex, such as 5112" if kind is Fault.EMERGENCY else "a whole number"
        wanted = f"{kind} takes {allowed}" if kind in NEEDS_VALUE else f"{kind} takes no value"
        raise CommandError(f"{text!r} found", wanted) from error
