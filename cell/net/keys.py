"""The keys of a cell, all in one place (`docs/architecture.md`, section 4).

Every key starts with `cell/<cell>/`, so one subscriber on `cell/<cell>/**` sees the whole cell.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass

from cell.messages import (
    ConveyorCount,
    Correction,
    DriveFeedback,
    Estop,
    Event,
    GatewayState,
    JogHeld,
    ManagerState,
    Presence,
    RobotState,
    SetpointBlock,
    ZoneGeometry,
)

ROOT = "cell"
_NAME = re.compile(r"[A-Za-z0-9_.-]+")


@dataclass(frozen=True, slots=True)
class Alive:
    """What a liveliness token's key says: one running process."""

    role: str
    name: str
    boot: str


@dataclass(frozen=True, slots=True)
class _Rule:
    """How the key of one kind of message is built, and which keys belong to it."""

    kind: type
    suffix: Callable[[object], str]
    pattern: re.Pattern[str]


def _rule(kind: type, template: str, *fields: str, chunk: str = r"[^/]+") -> _Rule:
    def suffix(message: object) -> str:
        return template.format(*[getattr(message, field) for field in fields])

    return _Rule(kind, suffix, re.compile(re.escape(template).replace(r"\{\}", chunk)))


_RULES = (
    _rule(Presence, "robot/{}/presence", "robot"),
    _rule(RobotState, "robot/{}/state", "robot"),
    _rule(SetpointBlock, "robot/{}/setpoints", "robot"),
    _rule(JogHeld, "robot/{}/jog", "robot"),
    _rule(Correction, "robot/{}/correction/{}", "robot", "name"),
    _rule(ConveyorCount, "conveyor/{}", "conveyor"),
    _rule(DriveFeedback, "robot/{}/drives", "robot"),
    _rule(ManagerState, "manager/state"),
    _rule(GatewayState, "gateway/{}/state", "gateway"),
    _rule(ZoneGeometry, "zone/{}", "zone"),
    _rule(Estop, "estop"),
    _rule(Event, "event/{}", "source", chunk=r"[^/]+(?:/[^/]+)?"),
)
STATE_KINDS: tuple[type, ...] = tuple(rule.kind for rule in _RULES)
_RULE_OF = {rule.kind: rule for rule in _RULES}


class Keys:
    """The keys of one cell."""

    def __init__(self, cell: str) -> None:
        if not _NAME.fullmatch(cell):
            raise ValueError(f"a cell's name is letters, digits, '_', '-' and '.', found {cell!r}")
        self.cell = cell
        self.prefix = f"{ROOT}/{cell}/"

    def of(self, message: object) -> str:
        """The key on which `message` travels. Raises `TypeError` for what is no state message."""
        rule = _RULE_OF.get(type(message))
        if rule is None:
            raise TypeError(f"{type(message).__name__} is no state message; calls go through ask() and answer()")
        return self.prefix + rule.suffix(message)

    def type_of(self, key: str) -> type | None:
        """The message class that travels on `key`; None when it is no state key of this cell."""
        if not key.startswith(self.prefix):
            return None
        rest = key[len(self.prefix) :]
        return next((rule.kind for rule in _RULES if rule.pattern.fullmatch(rest)), None)

    def alive(self, role: str, name: str, boot: str) -> str:
        """The key of a process' liveliness token."""
        return f"{self.prefix}alive/{role}/{name}/{boot}"

    def alive_of(self, key: str) -> Alive | None:
        """The process behind a liveliness token's key; None for other keys."""
        start = f"{self.prefix}alive/"
        chunks = key[len(start) :].split("/")
        return Alive(*chunks) if key.startswith(start) and len(chunks) == 3 and all(chunks) else None

    def command(self, to: str, verb: str) -> str:
        """The key of a call; `to` is `"manager"`, `"robot/<r>"` or `"gateway/<g>"`, `verb` may be `*`."""
        return f"{self.prefix}{to}/cmd/{verb}"
