"""The table of `docs/language.md` is the language."""

import re

import pytest

from robot_agent.language import STATEMENTS, Names, parse_program
from robot_agent.language.words import Word
from tests.unit.repository import ROOT

TABLE = re.findall(r"^\| (`.*`) \|", (ROOT / "docs" / "language.md").read_text(), re.M)
EXAMPLES = [example for cell in TABLE for example in re.findall("`(.*?)`", cell)]


def begun(example: str) -> str:
    """As what the statement is registered."""
    return Word(example.split()[0], 1).statement


def test_every_statement_has_an_example() -> None:
    assert {begun(example) for example in EXAMPLES} == set(STATEMENTS)


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_example_is_understood(example: str) -> None:
    text = example if example.startswith("LABEL") else f"LABEL name\n{example}"
    assert isinstance(parse_program(text, "p", Names(("J1", "J2"))).statements[-1], STATEMENTS[begun(example)])
