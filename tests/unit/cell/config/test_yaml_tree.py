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
        ("a: !secret b\n", "1:4 ('a',) the tag !secret"),
        ("a: !secret {b: 1}\n", "1:4 ('a',) the tag !secret"),
        ("a: !!int x\n", "1:4 ('a',) the tag !!int"),
        ("a: !!str 5\n", "1:4 ('a',) the tag !!str"),
        ("a: 1\nb: ! x\n", "2:4 ('b',) the tag !"),
        ("a: &x !!int '7'\n", "1:4 ('a',) the tag !!int"),
        ("a: &x # seven\n  !!int '7'\n", "1:4 ('a',) the tag !!int"),
        ("a: !!seq [1]\n", "1:4 ('a',) the tag !!seq"),
        ("!!str a: 1\n", "1:1 ('a',) the tag !!str"),
        ("%YAML 1.1\n---\nparts: yes\n", "1:1 () the directive %YAML 1.1"),
        ("# old\n\n%TAG ! x:\n---\na: 1\n", "3:1 () the directive %TAG ! x:"),
        ("? [1, 2]\n: 3\n", "1:3 () a key that is no text"),
        ("a: 1\n---\nb: 2\n", "2:1 () expected a single document in the stream but found another document"),
        ("a: 1\nb: \x07\n", "2:4 () the character '\\x07'"),
        ("[" * 500, "1:1 () brackets nested too deeply"),
    ],
)
def test_what_is_no_plain_yaml_is_refused_at_its_place(text: str, problem: str) -> None:
    assert problem in parsed(text)[2]


def test_what_only_looks_like_a_tag_or_a_directive_is_text() -> None:
    value, _, problems = parsed("a: '!!str 5'\nb: |\n  !x\n  %YAML 1.1\nc: &x 5\n'%d': a ! b\n")
    assert value == {"a": "!!str 5", "b": "!x\n%YAML 1.1\n", "c": 5, "%d": "a ! b"}
    assert problems == []


@settings(max_examples=200, deadline=None)
@given(st.text(alphabet=st.sampled_from("ab:-[]{}#&*!|>'\"%@`, \n\t0.~?\x00é"), max_size=40))
def test_no_text_raises(text: str) -> None:
    value, _, problems = parsed(text)
    assert value is not None or problems or text.strip()
