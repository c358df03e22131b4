"""The keys of a file as tables, made from its JSON Schema."""

from collections.abc import Iterator
from typing import Any

Schema = dict[str, Any]
_LIMITS = (("above", "exclusiveMinimum"), ("from", "minimum"), ("below", "exclusiveMaximum"), ("to", "maximum"))
_UNBOUNDED = 1e9
"""A limit as large as this is there against overflow, and is not worth reading."""


def reference(schema: Schema, title: str, level: int = 1) -> str:
    """Markdown with one table for each kind of entry, the whole file first."""
    defs = schema.get("$defs", {})
    parts = [f"{'#' * level} {title}", "", *_table(schema, defs)]
    for name in _in_order(schema, defs):
        parts += ["", f"{'#' * (level + 1)} {_plain(name)}", "", *_table(defs[name], defs)]
    return "\n".join(parts) + "\n"


def _table(schema: Schema, defs: Schema) -> Iterator[str]:
    if schema.get("description"):
        yield " ".join(schema["description"].split())
        yield ""
    if "enum" in schema:
        yield f"One of {_choices(schema)}."
        return
    required = schema.get("required", [])
    yield "| key | allowed | default | meaning |"
    yield "|---|---|---|---|"
    for key, entry in schema.get("properties", {}).items():
        meaning = entry.get("description", "").replace("|", "\\|")
        yield f"| `{key}` | {_allowed(entry, defs)} | {_default(key, entry, required)} | {meaning} |"


def _default(key: str, entry: Schema, required: list[str]) -> str:
    if key in required:
        return "must be given"
    default = entry.get("default")
    plain = isinstance(default, bool | int | float | str) and "default" not in entry.get("description", "")
    return f"`{str(default).lower() if isinstance(default, bool) else default}`" if plain else ""


def _allowed(entry: Schema, defs: Schema) -> str:
    if "$ref" in entry:
        name = entry["$ref"].rpartition("/")[2]
        return _choices(defs[name]) if "enum" in defs[name] else _plain(name)
    for joined in ("anyOf", "oneOf", "allOf"):
        if joined in entry:
            kinds = [_allowed(each, defs) for each in entry[joined] if each.get("type") != "null"]
            return " or ".join(dict.fromkeys(kinds))
    if "enum" in entry or "const" in entry:
        return _choices(entry)
    match entry.get("type"):
        case "object":
            named = [*entry.get("patternProperties", {}).values(), entry.get("additionalProperties")]
            return f"by name: {' or '.join(_allowed(each, defs) for each in named if isinstance(each, dict))}"
        case "array" if "prefixItems" in entry:
            kinds = list(dict.fromkeys(_allowed(each, defs) for each in entry["prefixItems"]))
            return f"list of {len(entry['prefixItems'])}: {', '.join(kinds)}"
        case "array":
            return f"list of {_allowed(entry.get('items', {}), defs)}"
        case "string":
            return "text" if "pattern" not in entry else f"text like `{entry['pattern']}`".replace("|", "\\|")
        case "integer" | "number":
            whole = "whole number" if entry["type"] == "integer" else "number"
            return " ".join([whole, *_range(entry)])
        case "boolean":
            return "`true`, `false`"
        case _:
            return "object"


def _range(entry: Schema) -> Iterator[str]:
    for word, key in _LIMITS:
        limit = entry.get(key)
        if limit is not None and abs(limit) < _UNBOUNDED:
            yield f"{word} {limit:g}"


def _choices(entry: Schema) -> str:
    values = entry.get("enum", [entry.get("const")])
    return ", ".join(f"`{value}`" for value in values)


def _plain(name: str) -> str:
    """`PathWindowEntry` in words."""
    words = "".join(f" {letter.lower()}" if letter.isupper() else letter for letter in name)
    return words.strip().removesuffix(" entry")


def _in_order(schema: Schema, defs: Schema) -> list[str]:
    """The kinds of entries in the order in which a reader meets them; plain choices stand in the tables."""
    found: list[str] = []

    def visit(value: object) -> None:
        if isinstance(value, dict):
            name = str(value.get("$ref", "")).rpartition("/")[2]
            if name in defs and name not in found and "enum" not in defs[name]:
                found.append(name)
                visit(defs[name])
            for key, each in value.items():
                if key != "$defs":
                    visit(each)
        elif isinstance(value, list):
            for each in value:
                visit(each)

    visit(schema)
    return found
