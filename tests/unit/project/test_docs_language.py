"""The table of `docs/language.md` is the language, and its programs are read."""

import re

import pytest

from robot_agent.language import STATEMENTS, Names, parse_program
from tests.unit.repository import ROOT

PAGE = (ROOT / "docs" / "language.md").read_text()
TABLE = re.findall(r"^\| (`.*`) \|", PAGE, re.M)
EXAMPLES = [example for cell in TABLE for example in re.findall("`(.*?)`", cell)]
PROGRAMS = re.findall(r"^```\n(.*?)^```", PAGE, re.M | re.S)
AROUND = {"IF": "{}\nENDIF", "ELSE": "IF 1 = 1\n{}\nENDIF", "ENDIF": "IF 1 = 1\n{}"}
"""What some statements are not without."""


def test_every_statement_has_an_example() -> None:
    assert {example.split()[0] for example in EXAMPLES} == set(STATEMENTS)


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_example_is_understood(example: str) -> None:
    text = AROUND.get(example.split()[0], "{}").format(example)
    if not example.startswith("LABEL"):
        text = f"LABEL name\nLET n = 0\n{text}"
    line = text.splitlines().index(example) + 1
    parsed = parse_program(text, "p", Names(("J1", "J2"))).statements
    (statement,) = [each for each in parsed if each.line == line]
    assert isinstance(statement, STATEMENTS[example.split()[0]])


@pytest.mark.parametrize("program", PROGRAMS)
def test_every_program_is_understood(program: str) -> None:
    assert parse_program(program, "p", Names(("J1", "J2", "J3", "J4", "J5", "J6"))).statements
