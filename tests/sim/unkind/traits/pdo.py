"""Drives whose PDOs cannot be set as one likes."""

from dataclasses import replace

from drive_gateway.canopen.cob_id import SDO_TO_NODE, TPDO1, function_code
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.sim.nodes.node import SimulatedNode
from drive_gateway.sim.services.abort import Abort
from drive_gateway.sim.services.dictionary import key_of
from drive_gateway.sim.services.pdo import (
    INVALID,
    NO_REMOTE,
    PDOS,
    RPDO_COMMUNICATION,
    RPDO_MAPPING,
    TPDO_COMMUNICATION,
    TPDO_MAPPING,
)
from tests.sim.unkind.traits.habits import constant, refuses, sends
from tests.sim.unkind.traits.trait import Trait

_COMMAND = (0x60400010, 0x607A0020)
_STATUS = (0x60410010, 0x60640020)
_OTHER_STATUS = (0x60410010, 0x60610008)
_CAN_ID = 0x1FFFFFFF
_LONGEST = 8


def _no_remote_frames(node: SimulatedNode) -> None:
    for number in PDOS:
        refuses(node, TPDO_COMMUNICATION + number, 1, Abort.RANGE, lambda value: not value & NO_REMOTE)


def _bit_30_stays(node: SimulatedNode) -> None:
    numbers = node.objects.numbers
    for number in PDOS:
        key = key_of(TPDO_COMMUNICATION + number, 1)

        def keep(value: int, key: int = key) -> None:
            numbers[key] = value | NO_REMOTE

        node.objects.followers[key] = keep


def _identifier_of_another_master(node: SimulatedNode) -> None:
    """It has other identifiers from before, and changes them only while the PDO does not exist."""
    numbers = node.objects.numbers
    for first, cob_id in ((RPDO_COMMUNICATION, 0x310), (TPDO_COMMUNICATION, 0x290 | NO_REMOTE)):
        key = key_of(first, 1)
        node.objects.declare(replace(node.objects.entry(key), default=cob_id, relative=False))

        def changed(value: int, key: int = key) -> bool:
            return not numbers[key] & INVALID and (value ^ numbers[key]) & _CAN_ID != 0

        refuses(node, first, 1, Abort.RANGE, changed)


def _fixed(node: SimulatedNode, mapping: int, entries: tuple[int, ...]) -> None:
    constant(node, mapping, 0, len(entries))
    for sub, entry in enumerate(entries, start=1):
        constant(node, mapping, sub, entry)


def _fixed_mapping_that_fits(node: SimulatedNode) -> None:
    _fixed(node, RPDO_MAPPING, _COMMAND)
    _fixed(node, TPDO_MAPPING, _STATUS)


def _fixed_mapping_that_does_not_fit(node: SimulatedNode) -> None:
    _fixed(node, RPDO_MAPPING, _COMMAND)
    _fixed(node, TPDO_MAPPING, _OTHER_STATUS)


def _mapping_of_cia_402(node: SimulatedNode) -> None:
    """What is needed is in its third PDOs."""
    for number, (command, status) in enumerate(
        (((0x60400010,), (0x60410010,)), ((0x60400010, 0x60600008), _OTHER_STATUS), (_COMMAND, _STATUS))
    ):
        _fixed(node, RPDO_MAPPING + number, command)
        _fixed(node, TPDO_MAPPING + number, status)


def _status_with_mode(node: SimulatedNode) -> None:
    _fixed(node, TPDO_MAPPING, (0x60410010, 0x60610008, 0x60640020))


def _fixed_type(node: SimulatedNode, transmission: int) -> None:
    constant(node, RPDO_COMMUNICATION, 2, 1)
    constant(node, TPDO_COMMUNICATION, 2, transmission)


def _unused_pdos_stay(node: SimulatedNode) -> None:
    for number in PDOS[2:]:
        key = key_of(TPDO_COMMUNICATION + number, 1)
        cob_id = TPDO1 + 0x100 * number | NO_REMOTE
        node.objects.declare(replace(node.objects.entry(key), default=cob_id, relative=True))
        refuses(node, TPDO_COMMUNICATION + number, 1, Abort.RANGE, lambda value: bool(value & INVALID))


def _an_unused_pdo_collides(node: SimulatedNode) -> None:
    """Its fourth TPDO has the identifier of its first one, and stays."""
    key = key_of(TPDO_COMMUNICATION + 3, 1)
    node.objects.declare(replace(node.objects.entry(key), default=TPDO1 | NO_REMOTE, relative=True))
    refuses(node, TPDO_COMMUNICATION + 3, 1, Abort.RANGE, lambda value: bool(value & INVALID))


def _two_pdos(node: SimulatedNode) -> None:
    for number in PDOS[2:]:
        for first in (RPDO_COMMUNICATION, RPDO_MAPPING, TPDO_COMMUNICATION, TPDO_MAPPING):
            node.objects.lack(first + number)


def _eight_bytes(node: SimulatedNode) -> None:
    def padded(frames: list[CanFrame], _now: float) -> list[CanFrame]:
        return [
            replace(frame, data=frame.data.ljust(_LONGEST, b"\xff"))
            if TPDO1 <= function_code(frame.id) < SDO_TO_NODE - 0x80
            else frame
            for frame in frames
        ]

    sends(node, padded)


_MAPPING = "CiA 301, objects 1600h and 1A00h: sub-index 00h may be const where the mapping is fixed; canopen issue 541"

PDO = (
    Trait(
        "tpdo_without_rtr",
        "Refuses a COB-ID of a TPDO whose bit 30 is 0 (06090030h), to disable it, too.",
        "CiA 301, object 1800h, sub-index 01h: the value for an unsupported RTR is refused; python canopen pull "
        "request 228: Roboteq FBL2360T",
        _no_remote_frames,
    ),
    Trait(
        "bit_30_stays",
        "Takes any COB-ID of a TPDO, and shows it with bit 30 set.",
        "CiA 301, object 1800h, sub-index 01h: bit 30 may be fixed where no remote frames are supported",
        _bit_30_stays,
    ),
    Trait(
        "identifiers_of_another_master",
        "Comes up with other COB-IDs, and refuses to change bits 0 to 28 of one that is valid, even as it is disabled.",
        "CiA 301, objects 1400h and 1800h: bits 0 to 29 may not be changed while the PDO exists",
        _identifier_of_another_master,
    ),
    Trait(
        "fixed_mapping",
        "Has its first PDOs mapped as CSP needs them, and its mappings can only be read.",
        _MAPPING,
        _fixed_mapping_that_fits,
    ),
    Trait(
        "fixed_mapping_of_another_kind",
        "Has statusword and mode in its first TPDO, and its mappings can only be read.",
        _MAPPING,
        _fixed_mapping_that_does_not_fit,
    ),
    Trait(
        "mapping_of_cia_402",
        "Has controlword and target position, statusword and position in its third PDOs, and its mappings can only be "
        "read.",
        "CiA 402, predefined PDOs of generic drives: PDO 1 has controlword or statusword alone, PDO 2 the mode, too, "
        "PDO 3 the position",
        _mapping_of_cia_402,
    ),
    Trait(
        "status_with_mode",
        "Has the mode between statusword and position, and the mapping of that TPDO can only be read.",
        _MAPPING,
        _status_with_mode,
    ),
    Trait(
        "fixed_transmission_type",
        "Has transmission type 1, and it can only be read.",
        "CiA 301, objects 1400h and 1800h: sub-index 02h may be const",
        lambda node: _fixed_type(node, 1),
    ),
    Trait(
        "fixed_event_driven",
        "Sends its TPDO on change (255), and the type can only be read.",
        "CiA 301, objects 1400h and 1800h: sub-index 02h may be const",
        lambda node: _fixed_type(node, 255),
    ),
    Trait(
        "unused_pdos_stay",
        "Refuses to disable its third and fourth TPDO, which have the identifiers of CiA 301.",
        "CANopenNode issue 270: a device whose PDO identifiers follow from its Node-ID and cannot be changed",
        _unused_pdos_stay,
    ),
    Trait(
        "unused_pdo_collides",
        "Refuses to disable its fourth TPDO, which has the identifier of its first one.",
        "CiA 301, predefined connection set: TPDO 1 has 180h + Node-ID; what a maker gives others is his own matter",
        _an_unused_pdo_collides,
    ),
    Trait(
        "two_pdos_each_way",
        "Has two RPDOs and two TPDOs.",
        "CiA 301, 7.5.2.35 and 7.5.2.37: each PDO is optional; the PDOs supported are the maker's",
        _two_pdos,
    ),
    Trait(
        "tpdos_of_eight_bytes",
        "Sends every TPDO with eight bytes, whatever is mapped.",
        "CiA 301, 7.5.2.36: of a longer PDO the first bytes count; zencan issue 67: TPDOs padded to eight bytes",
        _eight_bytes,
    ),
)
"""Habits with PDOs."""
