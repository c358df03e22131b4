"""Messages to bytes and back.

Everything is JSON, read strictly (unknown fields, wrong types, numbers and lengths out of range, NaN and infinities are
refused), but for the two streams of axis samples and the arrays of presences, whose layout is in `cell.net.binary`.
Malformed bytes raise `CodecError` and nothing else. What is written is not checked again: its sender keeps to the
ranges.
"""

import dataclasses
from collections.abc import Callable
from typing import Any, TypeVar, get_type_hints

from pydantic import ConfigDict, TypeAdapter, ValidationError, with_config
from pydantic_core import PydanticSerializationError

from cell.messages import (
    COMMANDS,
    STATES,
    Body,
    Call,
    DriveFeedback,
    Heard,
    KeptEvents,
    Presence,
    Reply,
    SetpointBlock,
    Urgency,
)
from cell.messages.common import Name
from cell.messages.sections import PlannedWay, Way
from cell.net import binary
from cell.net.errors import CodecError

T = TypeVar("T")

MOST_BYTES = 8 * 2**20
"""Of one message."""
MOST_URGENT_BYTES = 2 * 2**20
"""Of one that is read within a cycle."""
MOST_VALUES = 4500
"""In one that is read within a cycle, counted by commas outside of texts: time goes into wrong values, not into long
texts. The state of a manager with sixteen robots, a zone for every two of them, half of all in each queue, and sixteen
meetings of all has 3000."""
_MOST_TOLD = 100
"""Wrong values among which the first is looked for; to list more takes longer than to find them."""
_WITHIN_A_CYCLE = (Urgency.REAL_TIME, Urgency.INTERACTIVE)

_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False, ser_json_inf_nan="constants", strict=True)


_ADAPTERS: dict[type[Any], TypeAdapter[Any]] = {}
_CALL_FORMS: dict[type[Any], type[Any]] = {}


def _adapter(kind: type[Any]) -> TypeAdapter[Any]:
    """The JSON form of a message class; nested messages inherit its strictness."""
    if kind not in _ADAPTERS:
        _ADAPTERS[kind] = TypeAdapter(with_config(_STRICT)(kind))
    return _ADAPTERS[kind]


def _call_form(command: type[Any]) -> type[Any]:
    """A call whose command has a known type, so that JSON can be read without guessing."""
    if command not in _CALL_FORMS:
        fields: list[tuple[str, Any, Any]] = [
            ("id", Name, dataclasses.field()),
            ("command", command, dataclasses.field()),
            ("heard", Heard | None, dataclasses.field(default=None)),
        ]
        _CALL_FORMS[command] = dataclasses.make_dataclass(f"{command.__name__}Call", fields, frozen=True)
    return _CALL_FORMS[command]


def _presence_head() -> type[Any]:
    """All of a presence that is no array."""
    fields: list[tuple[str, Any, Any]] = []
    for kind, names in ((Body, _BODY_HEAD), (Way, _WAY_HEAD)):
        hints = get_type_hints(kind, include_extras=True)
        fields += [(name, hints[name], dataclasses.field()) for name in names]
    hints = get_type_hints(Presence, include_extras=True)
    own = {field.name: field for field in dataclasses.fields(Presence)}
    fields += [(name, hints[name], own[name]) for name in _PRESENCE_FIELDS]
    return dataclasses.make_dataclass("Presence", fields, frozen=True)


_BODY_HEAD = ("known", "base", "reach_m")
_WAY_HEAD = ("committed", "owned", "links", "fixed", "plan")
_PRESENCE_FIELDS = tuple(field.name for field in dataclasses.fields(Presence) if field.name not in ("body", "way"))
_PRESENCE_HEAD = _presence_head()


def encode(message: object) -> bytes:
    """The bytes of a state message or a `Reply`. Raises `CodecError` when it holds what must not travel (NaN)."""
    layout = _LAYOUTS.get(type(message))
    return _to_json(type(message), message) if layout is None else layout[0](message)


def decode(kind: type[T], data: bytes) -> T:
    """The message of class `kind` in `data`. Raises `CodecError`."""
    layout = _LAYOUTS.get(kind)
    if layout is None and kind in STATES and STATES[kind].urgency in _WITHIN_A_CYCLE:
        _check_urgent(kind.__name__, data)
    _check_size(kind.__name__, data, MOST_BYTES)
    message: T = _from_json(kind, data) if layout is None else layout[1](data)
    return message


def _encode_presence(presence: Presence) -> bytes:
    body, way = presence.body, presence.way
    values = {name: getattr(presence, name) for name in _PRESENCE_FIELDS}
    head = _PRESENCE_HEAD(
        body.known, body.base, body.reach_m, way.committed, way.owned, way.links, way.fixed, way.plan, **values
    )
    return binary.encode_presence(_to_json(_PRESENCE_HEAD, head), body, way)


def _decode_presence(data: bytes) -> Presence:
    read, (radii, growth, poses, tcp), sections, pieces = binary.decode_presence(data)
    head = _from_json(_PRESENCE_HEAD, read)
    if not head.committed <= head.owned <= len(sections):
        found = f"{head.committed} committed, {head.owned} owned of {len(sections)} sections"
        raise CodecError("Presence", f"{found}: allowed are no more committed than owned, no more owned than there are")
    if head.known and not len(poses):
        raise CodecError("Presence", "a body that is known, without poses: allowed is at least one, where the robot is")
    if len(pieces) != (len(sections) if head.plan else 0):
        found = f"{len(pieces)} pieces of {len(sections)} sections in plan {head.plan}"
        raise CodecError("Presence", f"{found}: allowed are one of each with a plan, none without (plan 0)")
    body = Body(head.known, head.base, head.reach_m, radii, poses, growth, tcp)
    way = Way(sections, head.committed, head.owned, head.links, head.fixed, head.plan, pieces)
    return Presence(body=body, way=way, **{name: getattr(head, name) for name in _PRESENCE_FIELDS})


def _planned_way_head() -> type[Any]:
    """All of a planned way that is no array."""
    hints = get_type_hints(PlannedWay, include_extras=True)
    fields = [(name, hints[name], dataclasses.field()) for name in _PLANNED_FIELDS]
    return dataclasses.make_dataclass("PlannedWay", fields, frozen=True)


_PLANNED_FIELDS = ("robot", "boot", "owner", "number", "more", "stays")
_PLANNED_HEAD = _planned_way_head()


def _encode_planned_way(way: PlannedWay) -> bytes:
    head = _PLANNED_HEAD(*(getattr(way, name) for name in _PLANNED_FIELDS))
    return binary.encode_planned_way(_to_json(_PLANNED_HEAD, head), way.pieces)


def _decode_planned_way(data: bytes) -> PlannedWay:
    read, pieces = binary.decode_planned_way(data)
    head = _from_json(_PLANNED_HEAD, read)
    for stay in head.stays:
        if not stay.first <= stay.last < len(pieces):
            found = f"a stay in zone {stay.zone} from piece {stay.first} to {stay.last} of {len(pieces)}"
            raise CodecError("PlannedWay", f"{found}: allowed is from one that there is to the same one or a later one")
    return PlannedWay(pieces=pieces, **{name: getattr(head, name) for name in _PLANNED_FIELDS})


_LAYOUTS: dict[type, tuple[Callable[[Any], bytes], Callable[[bytes], Any]]] = {
    SetpointBlock: (binary.encode_setpoints, binary.decode_setpoints),
    DriveFeedback: (binary.encode_feedback, binary.decode_feedback),
    Presence: (_encode_presence, _decode_presence),
    PlannedWay: (_encode_planned_way, _decode_planned_way),
}
"""How messages that are not JSON are written and read."""


def encode_call(call: Call) -> bytes:
    """The bytes of a call; its verb travels in the key."""
    kind = type(call.command)
    if not any(kind in verbs.values() for verbs in COMMANDS.values()):
        raise CodecError("Call", f"{call.command!r} is no command")
    form = _call_form(kind)
    return _to_json(form, form(call.id, call.command, call.heard))


def decode_call(to: str, verb: str, data: bytes) -> Call:
    """The call in `data`, sent to `to` (`"robot/left"`, `"manager"`, ...) with `verb`. Raises `CodecError`."""
    known = COMMANDS.get(to.split("/")[0], {})
    if verb not in known:
        raise CodecError("Call", f"verb {verb!r} is unknown to {to}; allowed: {', '.join(sorted(known)) or 'none'}")
    _check_size("Call", data, MOST_BYTES)
    form = _from_json(_call_form(known[verb]), data)
    return Call(form.id, form.command, form.heard)


def _check_size(kind: str, data: bytes, most: int) -> None:
    if len(data) > most:
        raise CodecError(kind, f"{len(data)} bytes, allowed are up to {most}")


def _check_urgent(kind: str, data: bytes) -> None:
    """Whatever somebody sends in place of such a message, a loop that reads it in its cycle is not late by it."""
    _check_size(kind, data, MOST_URGENT_BYTES)
    if data.count(b",") >= MOST_VALUES and (values := _values(data)) > MOST_VALUES:
        raise CodecError(kind, f"{values} values, allowed are up to {MOST_VALUES}")


def _values(data: bytes) -> int:
    """How many JSON has, at least; behind far too many texts commas in texts count as well."""
    parts = data.replace(b"\\\\", b"").replace(b'\\"', b"").split(b'"', 4 * MOST_VALUES)
    return 1 + sum(part.count(b",") for part in parts[::2])


def message_schemas() -> dict[str, Any]:
    """JSON Schemas of all that travels as JSON: state messages, `Reply` and `KeptEvents` by class, calls by verb.

    Of `Presence` and `PlannedWay` it is that of their heads.
    """
    kinds = [*(kind for kind in STATES if kind not in _LAYOUTS), Reply, KeptEvents, _PRESENCE_HEAD, _PLANNED_HEAD]
    schemas = {kind.__name__: _adapter(kind).json_schema() for kind in kinds}
    for role, verbs in COMMANDS.items():
        schemas |= {f"{role}/{verb}": _adapter(_call_form(kind)).json_schema() for verb, kind in verbs.items()}
    return schemas


def _to_json(kind: type[Any], message: object) -> bytes:
    try:
        data = _adapter(kind).dump_json(message, warnings="error")
    except PydanticSerializationError as error:
        raise CodecError(kind.__name__, f"cannot be encoded: {error}") from error
    if b"NaN" in data or b"Infinity" in data:
        _from_json(kind, data)
    return data


def _from_json(kind: type[Any], data: bytes) -> Any:
    try:
        return _adapter(kind).validate_json(data)
    except ValidationError as error:
        if error.error_count() > _MOST_TOLD:
            raise CodecError(kind.__name__, f"{error.error_count()} values are wrong or missing") from None
        first = error.errors(include_url=False, include_context=False)[0]
        where = ".".join(str(part) for part in first["loc"]) or "message"
        found = f", found {str(first['input'])[:60]!r}" if first["type"] != "missing" else ""
        raise CodecError(kind.__name__, f"{where}: {first['msg']}{found}") from error
