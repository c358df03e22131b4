"""`drive-gateway node-id`: the Node-ID of a node by layer setting services (CiA 305, by the `canopen` library)."""

import time
from typing import Annotated, Any

import typer
from canopen import lss

from cell.commands.bus_tools.bus_line import BusLine, NodeRefuses, NodeSilent
from cell.commands.bus_tools.drive_tools import MayMoveOption
from cell.commands.bus_tools.node_access import bus_alone
from cell.commands.bus_tools.place import BusPlace
from cell.commands.errors import CommandError

GATHER_S = 0.3
"""Answers of all nodes to one question have come by then."""
UNCONFIGURED = 0xFF
"""The Node-ID of a node that has none yet."""
_INQUIRIES = (
    ("vendor", lss.CS_INQUIRE_VENDOR_ID),
    ("product", lss.CS_INQUIRE_PRODUCT_CODE),
    ("revision", lss.CS_INQUIRE_REVISION_NUMBER),
    ("serial", lss.CS_INQUIRE_SERIAL_NUMBER),
)
_REFUSALS = {
    lss.CS_CONFIGURE_NODE_ID: {1: "the Node-ID is out of its range"},
    lss.CS_STORE_CONFIGURATION: {1: "it cannot store by LSS", 2: "its memory cannot be written"},
}
"""What the error codes of an answer mean (CiA 305)."""


def node_id(
    place: BusPlace,
    new: Annotated[int | None, typer.Argument(metavar="NEW", help="Node-ID to give it, 1 to 127.")] = None,
    vendor: Annotated[str | None, typer.Option(metavar="NUMBER", help="1018h:01 of the node that is meant.")] = None,
    product: Annotated[str | None, typer.Option(metavar="NUMBER", help="1018h:02.")] = None,
    revision: Annotated[str | None, typer.Option(metavar="NUMBER", help="1018h:03.")] = None,
    serial: Annotated[str | None, typer.Option(metavar="NUMBER", help="1018h:04.")] = None,
    store: Annotated[bool, typer.Option("--store/--no-store", help="Let it keep the new Node-ID.")] = True,
    may_move: MayMoveOption = False,
) -> None:
    """Show the Node-ID of a node by LSS (CiA 305), or give it a new one and let it store that.

    Without the four numbers of its identity (`scan` shows them, or its type plate) it must be the only node with LSS
    on the bus: switch the others off. The new Node-ID holds from its next start on. Many drives have no LSS; theirs is
    set by switches or the maker's tool.
    """
    if new is not None and not 1 <= new <= 127:
        raise CommandError(f"Node-ID {new}", "a Node-ID is 1 to 127; the gateway has 127", 2)
    address = _address({"vendor": vendor, "product": product, "revision": revision, "serial": serial})
    with bus_alone(place, "a gateway never changes a Node-ID", may_move) as bus:
        if new is not None:
            _refuse_taken(bus, place, new)
        master: Any = bus.network.lss
        answers: list[bytes] = []
        bus.hear(lambda number, data: answers.append(data) if number == master.LSS_RX_COBID else None)
        try:
            _select(master, address)
            before = _inquire(master, answers)
            if new is not None:
                _give(bus, master, new, before, store)
        finally:
            master.send_switch_state_global(master.WAITING_STATE)


def _address(numbers: dict[str, str | None]) -> list[int] | None:
    """The LSS address; `None` where none is named."""
    given = {name: text for name, text in numbers.items() if text is not None}
    if not given:
        return None
    missing = [f"--{name}" for name in numbers if name not in given]
    if missing:
        raise CommandError(f"{', '.join(missing)} missing", "a node is named by all four numbers of 1018h, or none", 2)
    try:
        found = [int(text[:-1], 16) if text.lower().endswith("h") else int(text, 0) for text in given.values()]
    except ValueError as error:
        raise CommandError(str(error), "numbers such as 4711, 0x1D or 1Dh", 2) from error
    if not all(0 <= number < 1 << 32 for number in found):
        raise CommandError("a number of 1018h has 32 bits", "0 to FFFFFFFFh", 2)
    return found


def _refuse_taken(bus: BusLine, place: BusPlace, new: int) -> None:
    try:
        bus.read(new, 0x1000, 0)
    except NodeSilent:
        return
    except NodeRefuses:
        pass
    raise CommandError(f"{place.label(new)} answers already", "no two nodes of a bus may have one Node-ID")


def _select(master: Any, address: list[int] | None) -> None:
    """Put one node into the configuration state."""
    if address is None:
        master.send_switch_state_global(master.CONFIGURATION_STATE)
        time.sleep(GATHER_S)
        return
    master.send_switch_state_global(master.WAITING_STATE)
    try:
        found = master.send_switch_state_selective(*address)
    except lss.LssError:
        found = False
    if not found:
        shown = ", ".join(f"{number:X}h" for number in address)
        raise CommandError(
            f"no node with the identity {shown} answers by LSS",
            "check the numbers (1018h), power, wiring and bit rate; many drives have no LSS",
        )


def _inquire(master: Any, answers: list[bytes]) -> int:
    """Show who is meant; answers its Node-ID."""
    answers.clear()
    try:
        present = int(master.inquire_node_id())
    except lss.LssError as error:
        raise CommandError(
            "no node answers by LSS", "check power, wiring and bit rate; many drives have no LSS"
        ) from error
    time.sleep(GATHER_S)
    if len(answers) > 1:
        raise CommandError(
            f"{len(answers)} nodes answer by LSS; nothing was changed",
            "name one by --vendor, --product, --revision and --serial (`read NODE 1018:03`), or switch the others off",
        )
    texts = []
    for name, question in _INQUIRIES:
        try:
            texts.append(f"{name} {master.inquire_lss_address(question):X}h")
        except lss.LssError:
            texts.append(f"{name} unknown")
    print(f"Node-ID {'none yet' if present == UNCONFIGURED else present}: {', '.join(texts)}", flush=True)
    return present


def _give(bus: BusLine, master: Any, new: int, before: int, store: bool) -> None:
    if 1 <= before <= 127:
        bus.refuse_torque(before, "a new Node-ID")
    _configure(master.configure_node_id, lss.CS_CONFIGURE_NODE_ID, new)
    if store:
        _configure(master.store_configuration, lss.CS_STORE_CONFIGURATION)
    kept = "stored" if store else "not stored: it is gone with the supply"
    begins = f"after: drive-gateway nmt ... {before} reset-communication" if 1 <= before <= 127 else "now"
    print(f"Node-ID {new} is set, {kept}; it holds {begins}")


def _configure(order: Any, code: int, *values: int) -> None:
    try:
        order(*values)
    except lss.LssError as error:
        reason = str(error).removeprefix("LSS Error: ")
        meaning = _REFUSALS[code].get(int(reason), f"error {reason}") if reason.isdigit() else str(error)
        raise CommandError(f"the node refuses by LSS: {meaning}") from error
