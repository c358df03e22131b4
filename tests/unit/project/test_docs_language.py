"""The table of `docs/language.md` is the language, and its programs are read."""

from pathlib import Path

import pytest

from robot_agent.language import STATEMENTS, Names, parse_program
from robot_agent.language.words import Word
from tests.unit.project.language_page import EXAMPLES, PROGRAMS

AROUND = {"IF": "{}\nENDIF", "ELSE": "IF 1 = 1\n{}\nENDIF", "ENDIF": "IF 1 = 1\n{}"}
"""What some statements are not without."""


def begun(example: str) -> str:
    """As what the statement is registered."""
    return Word(example.split()[0], 1).statement


def test_every_statement_has_an_example() -> None:
    assert {begun(example) for example in EXAMPLES} == set(STATEMENTS)


@pytest.mark.parametrize("example", EXAMPLES)
def test_every_example_is_understood(example: str, tmp_path: Path) -> None:
    (tmp_path / "cut.prog").write_text("WAIT 1")
    around = AROUND.get(example.split()[0], "{}").format(example)
    there = "" if example.startswith("LABEL") or "name" not in example else "LABEL name\nWAIT 1\nEND"
    behind = "" if example in ("END", "GOTO name") else "WAIT 1\nEND\n"
    text = f"LET n = 0\n{around}\n{behind}{there}"
    line = text.splitlines().index(example) + 1
    parsed = parse_program(text, "p", Names(("J1", "J2")), tmp_path).statements
    statement = next(each for each in parsed if each.line == line)
    assert isinstance(statement, STATEMENTS[begun(example)])


@pytest.mark.parametrize("program", PROGRAMS)
def test_every_program_of_the_page_is_one(program: str) -> None:
    assert parse_program(program, "p", Names(tuple(f"J{i}" for i in range(1, 7)))).statements
