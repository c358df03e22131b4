"""Drives that keep values of their own, or say nothing where a value belongs."""

from collections.abc import Callable

from drive_gateway.sim.drives.power_state import DriveState
from drive_gateway.sim.nodes.node import SimulatedNode
from drive_gateway.sim.services.abort import Abort, AccessRefused
from drive_gateway.sim.services.dictionary import key_of
from tests.sim.unkind.traits.habits import constant, refuses
from tests.sim.unkind.traits.trait import Trait

_QUICK_STOP_STAYS, _QUICK_STOP_OFF = 6, 2
_STATUSWORD = key_of(0x6041)
_OF_STATES, _OF_MODES = 0x6F, 1 << 10 | 1 << 12 | 1 << 13

_Update = Callable[[DriveState, int, bool], None]


def _own_reactions(node: SimulatedNode) -> None:
    constant(node, 0x605A, 0, _QUICK_STOP_STAYS)
    constant(node, 0x6007, 0, 3)


def _other_quick_stop(node: SimulatedNode) -> None:
    constant(node, 0x605A, 0, _QUICK_STOP_OFF)


def _milliseconds_only(node: SimulatedNode) -> None:
    constant(node, 0x60C2, 2, -3)


def _coarse_heartbeat(node: SimulatedNode) -> None:
    """It keeps tens of milliseconds."""
    key, configured = key_of(0x1017), node.objects.followers[key_of(0x1017)]

    def rounded(value: int) -> None:
        node.objects.numbers[key] = value // 100 * 100
        configured(node.objects.numbers[key])

    node.objects.followers[key] = rounded


def _one_following_time(node: SimulatedNode) -> None:
    constant(node, 0x6066, 0, 10)


def _mode_not_shown(node: SimulatedNode) -> None:
    read = node.objects.read

    def without(key: int) -> bytes:
        if key == key_of(0x6061):
            raise AccessRefused(Abort.NO_DATA)
        return read(key)

    node.objects.read = without  # type: ignore[method-assign]


def _bits_of_states_alone(node: SimulatedNode) -> None:
    for drive in node.drives:
        update = drive.shown.update

        def without(state: DriveState, mode_bits: int, following_error: bool, update: _Update = update) -> None:
            update(state, mode_bits, following_error)
            node.objects.numbers[_STATUSWORD] &= _OF_STATES | _OF_MODES

        drive.shown.update = without  # type: ignore[method-assign]


def _least_ramp(node: SimulatedNode) -> None:
    refuses(node, 0x6085, 0, Abort.TOO_HIGH, lambda value: value > 1_000_000)


VALUES = (
    Trait(
        "bits_of_states_alone",
        "Bits 4, 7, 9 and 11 of its statusword (voltage, warning, remote, internal limit) are 0 in every state.",
        "CiA 402-2, statusword: the states are told by bits 0 to 3, 5 and 6 alone, the others are x in that table",
        _bits_of_states_alone,
    ),
    Trait(
        "reactions_are_constant",
        "Has 605Ah = 6 and 6007h = 3, which can only be read.",
        "CiA 402-2, objects 605Ah and 6007h are optional; a maker with one reaction makes them const",
        _own_reactions,
    ),
    Trait(
        "another_quick_stop",
        "Has 605Ah = 2, which can only be read.",
        "CiA 402-2, object 605Ah is optional, default 2",
        _other_quick_stop,
    ),
    Trait(
        "milliseconds_only",
        "Has 60C2h:02 = -3, which can only be read.",
        "Delta ASDA-A2-E manual, 5.3.3: 60C2h:02 is always -3",
        _milliseconds_only,
    ),
    Trait(
        "coarse_heartbeat",
        "Takes any heartbeat time and keeps whole tenths of a second.",
        "CiA 301, object 1017h: a multiple of 1 ms; makers round it to their own timer",
        _coarse_heartbeat,
    ),
    Trait(
        "one_following_time",
        "Has one following-error time (6066h), which can only be read.",
        "CiA 402-2, object 6066h is optional",
        _one_following_time,
    ),
    Trait(
        "mode_is_not_shown",
        "Refuses to read 6061h (08000024h).",
        "CiA 402-2: object 6061h shows the mode that is in force; CiA 301, abort code 08000024h: no data available",
        _mode_not_shown,
    ),
    Trait(
        "ramp_with_an_end",
        "Refuses a quick-stop deceleration above a million counts/s^2 (06090031h).",
        "CiA 301, abort code 06090031h: value of parameter written too high",
        _least_ramp,
    ),
)
"""Habits with values."""
