"""YAML text becomes plain values with positions, or problems with positions; nothing else ever happens."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.config.problem import KeyPath
from cell.config.yaml_tree import Places, Value, parse


def parsed(text: str) -> tuple[Value, dict[KeyPath, Places], list[str]]:
    places: dict[KeyPath, Places] = {}
    found: list[str] = []
    value = parse(text, places, lambda place, path, what, _: found.append(f"{place[0]}:{place[1]} {path} {what}"))
    return value, places, found


def test_values_are_those_of_yaml_1_2() -> None:
    value, _, problems = parsed("[1, -2.5, 1e3, 010, 0x1F, true, yes, null, ~, text, '1', 2020-01-01, .inf]")
    assert value == [1, -2.5, 1000.0, 10, 31, True, "yes", None, None, "text", "1", "2020-01-01", math.inf]
    assert problems == []


def test_every_key_and_every_value_has_its_place() -> None:
    _, places, _ = parsed("robots:\n  left: {model: arm.yaml, size: [1, 2]}\n")
    assert places[("robots", "left", "model")] == Places((2, 10), (2, 17))
    assert places[("robots", "left", "size", 1)].value == (2, 37)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "1:1 () an empty file"),
        ("# nothing\n", "1:1 () an empty file"),
        ("a:\n\tb: 1\n", "2:1 () while scanning for the next token found character '\\t' that cannot start any token"),
        ("a: [1, 2\n", "2:1 () while parsing a flow sequence expected ',' or ']', but got '<stream end>'"),
        ("a: 1\nb: 2\na: 3\n", "3:1 ('a',) the key a second time (first in line 1)"),
        ("a: &x 1\nb: *x\n", "2:1 ('b',) an alias (*)"),
        ("a: &x [*x]\n", "1:4 ('a', 0) an alias (*)"),
        ("a: !secret b\n", "1:4 ('a',) !secret 'b'"),
        ("a: !secret {b: 1}\n", "1:4 ('a',) the tag !secret"),
        ("a: !!int x\n", "1:4 ('a',) int 'x'"),
        ("? [1, 2]\n: 3\n", "1:3 () a key that is no text"),
        ("a: 1\n---\nb: 2\n", "2:1 () expected a single document in the stream but found another document"),
        ("a: 1\nb: \x07\n", "2:4 () the character '\\x07'"),
        ("[" * 500, "1:1 () brackets nested too deeply"),
    ],
)
def test_what_is_no_plain_yaml_is_refused_at_its_place(text: str, problem: str) -> None:
    assert problem in parsed(text)[2]


@settings(max_examples=200, deadline=None)
@given(st.text(alphabet=st.sampled_from("ab:-[]{}#&*!|>'\"%@`, \n\t0.~?\x00é"), max_size=40))
def test_no_text_raises(text: str) -> None:
    value, _, problems = parsed(text)
    assert value is not None or problems or text.strip()
