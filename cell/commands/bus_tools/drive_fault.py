"""`drive-gateway fault`: a simulated drive fails, to see what follows."""

from typing import Annotated

import typer

from cell.commands.bus_tools.node_access import running_gateway
from cell.commands.bus_tools.place import BusPlace, NodeArgument, meant_node, number_text
from cell.commands.errors import CommandError
from cell.messages.drive_fault import NEEDS_VALUE, Fault, FaultDrive


def fault(
    place: BusPlace,
    node: NodeArgument,
    kind: Annotated[Fault, typer.Argument(metavar="FAULT", help=", ".join(Fault) + ".")],
    value: Annotated[
        str | None,
        typer.Argument(
            metavar="VALUE", help="Code of emcy in hex (5112), counts of encoder-jump, milliseconds of late-tpdos."
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
    meant = meant_node(place, node)
    order = FaultDrive(meant.id, meant.axis, kind, _number(kind, value), seconds)
    with running_gateway(place) as line:
        if line is None:
            raise CommandError(
                f"gateway {place.name} does not run, and only it orders a fault",
                f"{place.command('run', '--simulate')}; without --simulate where its drives run alone",
            )
        typer.echo(line.ask(order).text)


def _number(kind: Fault, text: str | None) -> int | None:
    if text is None:
        return None
    try:
        return int(number_text(text).removesuffix("h"), 16) if kind is Fault.EMERGENCY else int(number_text(text))
    except ValueError as error:
        allowed = "a code in hex, such as 5112" if kind is Fault.EMERGENCY else "a whole number"
        wanted = f"{kind} takes {allowed}" if kind in NEEDS_VALUE else f"{kind} takes no value"
        raise CommandError(f"{text!r} found", wanted) from error
