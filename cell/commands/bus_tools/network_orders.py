"""`drive-gateway nmt`: the network management of CiA 301, and whether the nodes did what they were told."""

import threading
from enum import StrEnum
from typing import Annotated

import typer

from cell.commands.bus_tools.bus_line import BusLine, NodeSilent
from cell.commands.bus_tools.drive_tools import MayMoveOption
from cell.commands.bus_tools.node_access import bus_alone
from cell.commands.bus_tools.place import BusPlace, meant_node
from cell.commands.errors import CommandError
from drive_gateway.canopen import cob_id
from drive_gateway.canopen.nmt import NmtCommand, NmtState, decode_heartbeat, nmt_frame

CONFIRM_S = 3.0
"""A node boots within a second or two; heartbeats come several times a second."""
EVERY = "all"


class NetworkOrder(StrEnum):
    START = "start"
    STOP = "stop"
    PRE_OPERATIONAL = "pre-operational"
    RESET_NODE = "reset-node"
    RESET_COMMUNICATION = "reset-communication"


_ORDERS = {
    NetworkOrder.START: (NmtCommand.START, NmtState.OPERATIONAL),
    NetworkOrder.STOP: (NmtCommand.STOP, NmtState.STOPPED),
    NetworkOrder.PRE_OPERATIONAL: (NmtCommand.ENTER_PRE_OPERATIONAL, NmtState.PRE_OPERATIONAL),
    NetworkOrder.RESET_NODE: (NmtCommand.RESET_NODE, NmtState.BOOT_UP),
    NetworkOrder.RESET_COMMUNICATION: (NmtCommand.RESET_COMMUNICATION, NmtState.BOOT_UP),
}
"""The command, and the state in which a node's heartbeat or boot-up then shows it."""
_TAKES_TORQUE = (NetworkOrder.STOP, NetworkOrder.RESET_NODE, NetworkOrder.RESET_COMMUNICATION)


def nmt(
    place: BusPlace,
    node: Annotated[str, typer.Argument(metavar="NODE", help=f"Node-ID, ROBOT.AXIS such as left.J1, or {EVERY}.")],
    order: Annotated[NetworkOrder, typer.Argument(metavar="ORDER", help=", ".join(NetworkOrder) + ".")],
    may_move: MayMoveOption = False,
) -> None:
    """Order nodes into a network state, or let them start again (NMT, CiA 301), and show what they say to it.

    A gateway does this by itself, so none may run. `stop` and both resets are refused while a drive has its power stage
    on, for its axis may run on or drop; and where a node does not tell that, unless with `--may-move`. NMT itself has
    no answer: a reset shows in the boot-up, other orders in the heartbeat, which a node has as far as its 1017h is set.
    """
    wanted = None if node == EVERY else meant_node(place, node).id
    instead = "a gateway starts its nodes by itself, its robots obey `cell reset ROBOT` and `cell disable ROBOT`"
    with bus_alone(place, instead, may_move) as bus:
        nodes = sorted({*bus.answering()} | bus.living) if wanted is None else [wanted]
        if order in _TAKES_TORQUE and not may_move:
            for number in nodes:
                _refuse_torque(bus, number, order)
        silent = _carry_out(bus, wanted or 0, order, nodes, place)
    if silent is None:
        raise CommandError(
            f"no node answers, nor was anything heard within {CONFIRM_S:g} s that confirms {order}",
            "stopped nodes without a heartbeat (1017h) obey all the same; else check power, wiring and bit rate",
        )
    if silent:
        raise CommandError(
            f"{', '.join(map(place.label, silent))}: nothing was heard within {CONFIRM_S:g} s that confirms {order}",
            "it may have obeyed all the same: a node without a heartbeat (1017h is 0) does not tell its state",
        )


def _refuse_torque(bus: BusLine, node: int, order: NetworkOrder) -> None:
    try:
        bus.refuse_torque(node, f"NMT {order}")
    except NodeSilent as error:
        raise CommandError(
            f"node {node} does not tell whether it has torque ({error.what}); NMT {order} is refused",
            "order it pre-operational first, for a stopped node answers nothing; or add --may-move",
        ) from error


def _carry_out(
    bus: BusLine, addressed: int, order: NetworkOrder, nodes: list[int], place: BusPlace
) -> list[int] | None:
    """Send the order; answers which of the nodes did not confirm it, `None` where nobody at all is known."""
    command, shown = _ORDERS[order]
    open_, confirmed, done = {*nodes}, set[int](), threading.Event()

    def heard(number: int, data: bytes) -> None:
        node, state = cob_id.node_id(number), decode_heartbeat(data)
        if cob_id.function_code(number) != cob_id.ERROR_CONTROL or state is not shown or node in confirmed:
            return
        if node in open_ or not addressed:
            print(f"{place.label(node)}: {'boot-up' if state is NmtState.BOOT_UP else state.words}", flush=True)
            confirmed.add(node)
            if nodes and confirmed >= open_:
                done.set()

    bus.hear(heard)
    frame = nmt_frame(command, addressed)
    bus.send(frame.id, frame.data)
    done.wait(CONFIRM_S)
    return sorted(open_ - confirmed) if nodes or confirmed else None
