"""`cell format` writes programs in one way and changes nothing that they mean."""

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from cell.commands.cell_command import app
from robot_agent.language import Names, ProgramError, parse_program
from robot_agent.language.form import formatted
from tests.unit.repository import ROOT

SHORT = """\
// a start
home f50          // slowly

again:  mj J1=10 r20
  ML X = 5 F100 ;fast
GOTO again 3
trk 0
set do F1
t = gripper
t2
"""
LONG = """\
; a start
HOME F=50         ; slowly

LABEL again
MJ J1=10 R=20
  ML X=5 F=100  ;fast
GOTO again 3
TRACK OFF
SET do F1
T=gripper
T2
"""


def meaning(text: str) -> object:
    try:
        parsed = parse_program(text, "p", Names(("J1", "J2")))
    except ProgramError as error:
        return [
            (each.found.upper().replace("TRK", "TRACK").replace(" = ", "="), each.allowed) for each in error.problems
        ]
    return [replace(each, line=0) for each in parsed.statements]


def test_short_forms_become_long_ones_and_comments_stay_where_they_are() -> None:
    assert formatted(SHORT) == LONG
    assert meaning(SHORT) == meaning(LONG)


WORDS = st.sampled_from(
    [
        "MJ",
        "ml",
        "home",
        "J1=1",
        "x = 2",
        "F50",
        "r=0",
        "a:",
        "GOTO",
        "a",
        "F1",
        "; c",
        "// d;",
        "wait",
        "1",
        "trk",
        "0",
    ]
)


@given(st.lists(st.lists(WORDS, max_size=5).map(" ".join), max_size=6).map("\n".join))
def test_formatting_changes_no_meaning_and_is_done_at_once(text: str) -> None:
    once = formatted(text)
    assert formatted(once) == once
    assert meaning(once) == meaning(text)


@pytest.mark.parametrize("program", sorted((ROOT / "cell_configs").rglob("*.prog")), ids=lambda each: each.name)
def test_shipped_programs_are_written_so(program: Path) -> None:
    assert formatted(program.read_text()) == program.read_text()


def test_a_file_is_changed_only_when_that_is_asked_for(tmp_path: Path) -> None:
    program = tmp_path / "a.prog"
    program.write_text(SHORT)
    result = CliRunner().invoke(app, ["format", str(program), "--check"])
    assert (result.exit_code, program.read_text()) == (1, SHORT)
    assert "would change" in result.output
    assert CliRunner().invoke(app, ["format", str(program)]).exit_code == 0
    assert program.read_text() == LONG
    assert CliRunner().invoke(app, ["format", str(program), "--check"]).exit_code == 0
    assert [each.name for each in tmp_path.iterdir()] == ["a.prog"]
