"""A message as JSON that has all of it, and the schema by which a viewer finds its fields.

It is the JSON of `cell.net.codec`, also of the messages that travel as bytes. Their arrays: samples of axes at one
moment are a list of numbers; whatever has more dimensions, or is no double, is `{"shape": [...], "data": <base64>}`,
little-endian, in the type that its field has.
"""

import base64
import dataclasses
from functools import cache
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pydantic_core
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from cell.messages import STATES, DriveFeedback
from cell.net.codec import decode, encode
from cell.net.errors import CodecError

KINDS = {kind.__name__: kind for kind in STATES}
"""Message classes by their names, which are the names of the schemas."""
_PACKED = {
    "type": "object",
    "properties": {
        "shape": {"type": "array", "items": {"type": "integer"}},
        "data": {"type": "string", "contentEncoding": "base64"},
    },
}


def to_json(message: object) -> bytes:
    """All of a state message."""
    return pydantic_core.to_json(message, fallback=_array_form)


def from_json(kind: type, data: bytes) -> Any:
    """The message of class `kind` in `data`. Raises `CodecError`."""
    if not _arrays(kind):
        return decode(kind, data)
    try:
        message = _built(kind, pydantic_core.from_json(data))
    except (ValidationError, ValueError, KeyError, TypeError) as error:
        raise CodecError(kind.__name__, f"cannot be read: {error}") from error
    return decode(kind, encode(message))


@cache
def schema_of(kind: Any) -> dict[str, Any]:
    """JSON Schema of what `to_json` writes, in the few words that viewers of MCAP files know.

    Without references and alternatives: of a field that may be null it is the schema of what else it may be. What
    cannot be said so is left out, and is in the message all the same.
    """
    if not _arrays(kind):
        whole = _adapter(kind).json_schema()
        return {"title": kind.__name__, **(_plain(whole, whole.get("$defs", {})) or {"type": "object"})}
    return {"title": kind.__name__, **_object(kind, kind is DriveFeedback)}


def _object(kind: Any, lists: bool) -> dict[str, Any]:
    """Of a class with arrays; `lists`: those of doubles are lists."""
    properties = {}
    for name, hint in _hints(kind).items():
        dtype = _dtype(hint)
        if dtype is not None:
            vector = lists and dtype == np.float64
            properties[name] = {"type": "array", "items": {"type": "number"}} if vector else _PACKED
        elif _arrays(hint):
            properties[name] = _object(hint, lists)
        else:
            whole = _adapter(hint).json_schema()
            if said := _plain(whole, whole.get("$defs", {})):
                properties[name] = said
    return {"type": "object", "description": kind.__doc__ or "", "properties": properties}


def _plain(schema: dict[str, Any], defs: dict[str, Any]) -> dict[str, Any] | None:
    """`schema` without references, alternatives and ranges; None where it cannot be said so."""
    if "$ref" in schema:
        schema = {**defs[schema["$ref"].rpartition("/")[2]], **schema}
    if "anyOf" in schema:
        choices = [each for each in schema["anyOf"] if each.get("type") != "null"]
        return _plain(choices[0], defs) if len(choices) == 1 else None
    told = {"description": schema["description"]} if "description" in schema else {}
    match schema.get("type"):
        case "object":
            parts = {name: _plain(each, defs) for name, each in schema.get("properties", {}).items()}
            return {"type": "object", **told, "properties": {name: part for name, part in parts.items() if part}}
        case "array":
            items = schema.get("items") or (schema.get("prefixItems") or [None])[0]
            item = None if items is None else _plain(items, defs)
            return None if item is None or item["type"] == "array" else {"type": "array", **told, "items": item}
        case "string" | "number" | "integer" | "boolean" as word:
            return {"type": word, **told}
    return None


def _array_form(value: object) -> object:
    if not isinstance(value, np.ndarray):
        raise TypeError(f"{type(value).__name__} is no part of a message")
    if value.ndim == 1 and value.dtype == np.float64:
        return value.tolist()
    data = value.astype(value.dtype.newbyteorder("<")).tobytes()
    return {"shape": value.shape, "data": base64.b64encode(data).decode()}


def _array(dtype: np.dtype[Any], value: Any) -> NDArray[Any]:
    if isinstance(value, list):
        return np.array(value, dtype)
    read = np.frombuffer(base64.b64decode(value["data"], validate=True), dtype.newbyteorder("<"))
    return read.astype(dtype).reshape(value["shape"])


def _built(hint: Any, value: Any) -> Any:
    """A field's value of the JSON that `to_json` wrote."""
    dtype = _dtype(hint)
    if dtype is not None:
        return None if value is None else _array(dtype, value)
    if not _arrays(hint):
        return _adapter(hint).validate_python(value)
    hints = _hints(hint)
    if not isinstance(value, dict):
        raise TypeError(f"{type(value).__name__} found, allowed is an object")
    if unknown := set(value) - set(hints):
        raise ValueError(f"unknown {', '.join(sorted(unknown))}")
    return hint(**{name: _built(hints[name], each) for name, each in value.items()})


@cache
def _adapter(hint: Any) -> TypeAdapter[Any]:
    return TypeAdapter(hint)


@cache
def _arrays(kind: Any) -> bool:
    """Whether something in a class is an array."""
    fields = _hints(kind) if hasattr(kind, "__dataclass_fields__") else {}
    return any(_dtype(hint) is not None or _arrays(hint) for hint in fields.values())


@cache
def _hints(kind: Any) -> dict[str, Any]:
    hints = get_type_hints(kind, include_extras=True)
    return {field.name: hints[field.name] for field in dataclasses.fields(kind)}


@cache
def _dtype(hint: Any) -> np.dtype[Any] | None:
    """Of an array, or of one that may be missing; None for all else."""
    arrays = [each for each in (hint, *get_args(hint)) if get_origin(each) is np.ndarray]
    return np.dtype(get_args(get_args(arrays[0])[1])[0]) if arrays else None
