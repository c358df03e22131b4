"""The table of `docs/language.md` is the language."""

import re
from pathlib import Path

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
def test_every_example_is_understood(example: str, tmp_path: Path) -> None:
    (tmp_path / "cut.prog").write_text("WAIT 1")
    there = "" if example.startswith("LABEL") or "name" not in example else "LABEL name\nWAIT 1\nEND"
    behind = "" if example in ("END", "GOTO name") else "WAIT 1\nEND\n"
    text = f"{example}\n{behind}{there}"
    parsed = parse_program(text, "p", Names(("J1", "J2")), tmp_path)
    assert isinstance(parsed.statements[0], STATEMENTS[begun(example)])


EXAMPLE_PROGRAMS = re.findall(r"^```\n(.*?)^```$", (ROOT / "docs" / "language.md").read_text(), re.M | re.S)


@pytest.mark.parametrize("program", EXAMPLE_PROGRAMS)
def test_every_program_of_the_page_is_one(program: str) -> None:
    assert parse_program(program, "p", Names(tuple(f"J{i}" for i in range(1, 7)))).statements
