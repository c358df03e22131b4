"""A document against its schema: all problems at once, and as much of the value as the later checks can use."""

import types
import typing
from collections.abc import Mapping
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from cell.config.document import Document, value_text
from cell.config.problem import KeyPath, Problem
from cell.config.units import ToSI
from cell.config.yaml_tree import Value

M = TypeVar("M", bound=BaseModel)

_ALLOWED = {
    "string_type": "text",
    "string_pattern_mismatch": "text matching {pattern}",
    "string_too_short": "text that is not empty",
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "bool_type": "true or false",
    "finite_number": "a finite number",
    "greater_than": "more than {gt:g}",
    "greater_than_equal": "{ge:g} or more",
    "less_than": "less than {lt:g}",
    "less_than_equal": "{le:g} or less",
    "too_short": "{min_length} or more",
    "too_long": "{max_length} or less",
    "literal_error": "{expected}",
    "enum": "{expected}",
    "dict_type": "a mapping of names to values",
    "model_type": "a mapping of keys to values",
    "tuple_type": "a list",
    "value_error": "{error}",
}


def validate(document: Document, schema: type[M], stand_ins: Mapping[str, Any]) -> tuple[M | None, list[Problem]]:
    """The validated value in SI units and all problems.

    With problems the value is what is left when everything wrong is taken out: unknown keys, and entries of mappings
    and optional keys that are wrong inside. It is good for further checks only. `stand_ins` replace required top-level
    keys on which no further check depends; None when another required part is wrong.
    """
    data = _with_tuples(document.data)
    si = ToSI.of(document.value(("units",)))
    try:
        return schema.model_validate(data, context=si), []
    except ValidationError as error:
        # a default that follows from another value is not made where that value is wrong, which is reported itself
        details = [each for each in error.errors(include_url=False) if each["type"] != "default_factory_not_called"]
    paths = [_path(detail, document) for detail in details]
    problems = _problems(list(zip(details, paths, strict=True)), document, schema)
    removed = [_remove(data, path, schema, stand_ins) for path in paths]
    if not all(removed):
        return None, problems
    try:
        return schema.model_validate(data, context=si), problems
    except ValidationError:
        return None, problems  # what is left lacks what was taken out


def _problems(found: list[tuple[ErrorDetails, KeyPath]], document: Document, schema: type[BaseModel]) -> list[Problem]:
    """One problem per place and finding; the alternatives of a value are put together."""
    problems: dict[tuple[KeyPath, str], Problem] = {}
    for detail, path in found:
        inside = any(other[: len(path)] == path and len(other) > len(path) for _, other in found)
        if inside and detail["type"] in ("too_short", "too_long"):
            continue  # only what is right counts, so that it is too few because of what is wrong
        problem = _problem(detail, path, document, schema)
        key = path, problem.found
        known = problems.get(key)
        if known is None:
            problems[key] = problem
        elif problem.allowed not in known.allowed:
            problems[key] = document.problem(path, known.found, f"{known.allowed} or {problem.allowed}")
    return list(dict.fromkeys(problems.values()))


def _path(detail: ErrorDetails, document: Document) -> KeyPath:
    """Where the error is in the file: pydantic also names keys and alternatives, which the file does not have."""
    path: KeyPath = detail["loc"]
    if path[-1:] == ("[key]",):
        return path[:-1]
    if detail["type"] == "missing":
        return path
    while path and path not in document.places:
        path = path[:-1]
    return path


def _problem(detail: ErrorDetails, path: KeyPath, document: Document, schema: type[BaseModel]) -> Problem:
    kind = detail["type"]
    if kind == "missing" and isinstance(path[-1], int):
        values = document.value(path[:-1])
        count = len(values) if isinstance(values, list) else 0
        return document.problem(path[:-1], f"{count} values", _description(schema, path[:-1]) or "more")
    if kind == "missing":
        return document.problem(path, "nothing", _description(schema, path) or "a value")
    if kind == "extra_forbidden":
        names = ", ".join(_fields(schema, path[:-1])) or "none"
        return document.problem(path, f"unknown key {path[-1]!r}", f"one of {names}", at_key=True)
    if detail["loc"][-1:] == ("[key]",):
        return document.problem(path, f"the name {value_text(path[-1])}", _allowed(detail), at_key=True)
    found = document.found(path)
    value = document.value(path)
    if kind in ("too_short", "too_long") and isinstance(value, dict | list) and value:
        found = f"{len(value)} entries"
    return document.problem(path, found, _allowed(detail))


def _allowed(detail: ErrorDetails) -> str:
    template = _ALLOWED.get(detail["type"])
    if template is None:
        return detail["msg"]
    text = template.format(**detail.get("ctx", {}))
    return text.replace("^", "").replace("$", "") if detail["type"] == "string_pattern_mismatch" else text


def _with_tuples(value: Value) -> Any:
    """A copy with tuples for lists: strict schemas take a tuple for a fixed sequence."""
    if isinstance(value, dict):
        return {key: _with_tuples(item) for key, item in value.items()}
    return tuple(map(_with_tuples, value)) if isinstance(value, list) else value


def _remove(data: Any, path: KeyPath, schema: type[BaseModel], stand_ins: Mapping[str, Any]) -> bool:
    """Take out the innermost part around `path` that the schema can do without; False when there is none."""
    for length in range(len(path), 0, -1):
        parent, key = _descend(data, path[: length - 1]), path[length - 1]
        if not isinstance(parent, dict):
            continue
        if key not in parent:
            if length < len(path):
                return True  # taken out already, for another error inside it
            continue
        if _is_optional(schema, path[:length]):
            del parent[key]
            return True
    if path and path[0] in stand_ins and isinstance(data, dict):
        data[path[0]] = stand_ins[str(path[0])]
        return True
    return False


def _descend(data: Any, path: KeyPath) -> Any:
    for key in path:
        try:
            data = data[key]
        except (KeyError, IndexError, TypeError):
            return None
    return data


def _is_optional(schema: type[BaseModel], path: KeyPath) -> bool:
    parent = _type_at(schema, path[:-1])
    if isinstance(parent, type) and issubclass(parent, BaseModel):
        field = parent.model_fields.get(str(path[-1]))
        return field is None or not field.is_required()
    return typing.get_origin(parent) is dict


def _fields(schema: type[BaseModel], path: KeyPath) -> list[str]:
    kind = _type_at(schema, path)
    return list(kind.model_fields) if isinstance(kind, type) and issubclass(kind, BaseModel) else []


def _description(schema: type[BaseModel], path: KeyPath) -> str | None:
    parent = _type_at(schema, path[:-1])
    if isinstance(parent, type) and issubclass(parent, BaseModel):
        return parent.model_fields[str(path[-1])].description
    return None


def _type_at(schema: type[BaseModel], path: KeyPath) -> Any:
    """The plain type that the schema has at `path`; None beyond its end."""
    kind: Any = schema
    for key in path:
        kind = _plain(kind)
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            field = kind.model_fields.get(str(key))
            kind = field.annotation if field is not None else None
        elif typing.get_origin(kind) is dict:
            kind = typing.get_args(kind)[1]
        elif typing.get_origin(kind) is tuple:
            kind = typing.get_args(kind)[0]
        else:
            return None
    return _plain(kind)


def _plain(kind: Any) -> Any:
    if typing.get_origin(kind) is Annotated:
        return _plain(typing.get_args(kind)[0])
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        kinds = [each for each in typing.get_args(kind) if each is not types.NoneType]
        return _plain(kinds[0]) if len(kinds) == 1 else None
    return kind
