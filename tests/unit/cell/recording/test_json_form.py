"""The JSON of a recording has all of a message, and its schema is of the words that viewers know."""

import json
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings

from cell.messages import STATES
from cell.net.errors import CodecError
from cell.recording.json_form import from_json, schema_of, to_json
from tests.unit.cell.recording.recordings import ANY
from tests.unit.message_kinds import same


@given(ANY)
@settings(suppress_health_check=[HealthCheck.too_slow])
def test_every_message_comes_back_as_it_was(message: Any) -> None:
    assert same(from_json(type(message), to_json(message)), message)


@given(ANY)
@settings(suppress_health_check=[HealthCheck.too_slow])
def test_what_the_schema_says_is_what_is_written(message: Any) -> None:
    check(schema_of(type(message)), json.loads(to_json(message)))


def check(schema: dict[str, Any], value: Any) -> None:
    """A strict reader of the few words of a schema: viewers refuse a channel with any other."""
    words = {"object": dict, "array": list, "string": str, "number": (int, float), "integer": int, "boolean": bool}
    assert set(schema) <= {"type", "title", "description", "properties", "items", "contentEncoding"}
    if value is None:
        return
    assert isinstance(value, words[schema["type"]])
    for name, part in schema.get("properties", {}).items():
        check(part, value[name])
    for each in value if schema["type"] == "array" else ():
        assert schema["items"]["type"] != "array"
        check(schema["items"], each)


@pytest.mark.parametrize("kind", STATES, ids=lambda kind: kind.__name__)
def test_a_schema_is_named_for_its_message(kind: type) -> None:
    assert schema_of(kind)["title"] == kind.__name__
    assert schema_of(kind)["properties"]


@pytest.mark.parametrize("kind", STATES, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("data", [b"", b"[]", b"{", b"null", b'{"strange": 1}', b'{"position": {"shape": 1}}'])
def test_what_is_no_message_is_an_error_of_the_codec(kind: type, data: bytes) -> None:
    with pytest.raises(CodecError, match=kind.__name__):
        from_json(kind, data)
