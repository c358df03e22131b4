"""Drives whose emergencies mean less than a fault, come too often, or end in another way."""

from collections.abc import Callable

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.nmt import NmtState
from drive_gateway.sim.nodes.node import SimulatedNode
from tests.sim.unkind.traits.trait import Trait

_GENERIC, _TEMPERATURE, _COMMUNICATION = 0x01, 0x08, 0x10
_ERROR_PASSIVE, _OVERRUN, _HOT, _NO_ERROR = 0x8120, 0x8110, 0x4310, 0x0000
_PASSIVE_S = 0.5
"""So long a node on a poor cable is error passive, and as long it is not."""

_Telling = Callable[[float], list[tuple[int, int]]]
"""Which codes and error registers a node tells, asked again and again with the time since it came up [s]."""


def _tells(node: SimulatedNode, telling: _Telling) -> None:
    """Let a node tell these emergencies beside its own, while it may send any."""
    own = node.timers
    up_at: float | None = None

    def timers() -> list[CanFrame]:
        nonlocal up_at
        if node.nmt not in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL):
            up_at = None
            return own()
        if up_at is None:
            up_at = node.now
        for code, register in telling(node.now - up_at):
            node.emergencies.say(code, register)
        return own()

    node.timers = timers  # type: ignore[method-assign]


def _once(*told: tuple[float, int, int]) -> _Telling:
    """Each code with its register once, so many seconds after the node came up, and again when it comes up anew."""
    last = 0.0

    def telling(since: float) -> list[tuple[int, int]]:
        nonlocal last
        before, last = (last if since >= last else -1.0), since
        return [(code, register) for at, code, register in told if before < at <= since]

    return telling


def _error_passive(node: SimulatedNode) -> None:
    passive = False

    def telling(since: float) -> list[tuple[int, int]]:
        nonlocal passive
        before, passive = passive, int(since / _PASSIVE_S) % 2 == 1
        if passive == before:
            return []
        return [(_ERROR_PASSIVE, _GENERIC | _COMMUNICATION) if passive else (_NO_ERROR, 0)]

    _tells(node, telling)


def _storm(node: SimulatedNode) -> None:
    def telling(since: float) -> list[tuple[int, int]]:
        return [(_HOT, _GENERIC | _TEMPERATURE)] if since > 2.0 else []

    _tells(node, telling)


def _overrun_that_stays(node: SimulatedNode) -> None:
    register = _GENERIC | _COMMUNICATION
    _tells(node, _once((2.0, _OVERRUN, register), (2.1, _NO_ERROR, register)))


def _reset_at_start(node: SimulatedNode) -> None:
    _tells(node, _once((0.0, _NO_ERROR, 0)))


EMERGENCY = (
    Trait(
        "error_passive_goes_on",
        "Says 8120h when its CAN controller is error passive and 0000h when it is not any more, and goes on moving.",
        "Novanta Summit drives, CANopen operation errors: 8120h is 'Info - Nothing'; Faulhaber MC 5004, CANopen "
        "communication manual (7000.05050), 3.10.1: 0000h follows once the drive is error active again",
        _error_passive,
    ),
    Trait(
        "emergency_storm",
        "Tells a cause that comes and goes around its limit anew each time, as fast as it looks at it.",
        "CiA 301, 7.2.7.1: one emergency per error event; 1015h (inhibit time) is 0 by default, which limits nothing",
        _storm,
    ),
    Trait(
        "overrun_that_stays",
        "Says 8110h, then 0000h with the error register still set, and goes on moving.",
        "Faulhaber MC 5004, CANopen communication manual (7000.05050), 3.10.1: 0000h does not retract a CAN overrun, "
        "its bits stay until the controller is restarted; CiA 301, 7.2.7.1, transition 2: 0000h with other errors left",
        _overrun_that_stays,
    ),
    Trait(
        "error_reset_at_start",
        "Says 0000h when it has come up, although nothing was wrong.",
        "CiA 301, 7.2.7.1: 00xxh is 'error reset or no error', and may be sent whenever all errors are gone",
        _reset_at_start,
    ),
)
"""Habits with EMCY."""
