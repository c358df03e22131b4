"""Round edges without effect are told before a program runs."""

from pathlib import Path

import pytest

from cell.commands.checks import check_cell
from cell.commands.checks.edges import idle_edges
from cell.config.problem import refuses
from robot_agent.language import Names, parse_program
from tests.unit.config_world import Copy

JOINTS = ("J1", "J2")
PROGRAM = "two_arms/programs/left.prog"


def found(text: str) -> list[tuple[int, str]]:
    return list(idle_edges(parse_program(text, "p", Names(JOINTS))))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("ML X=1 R=5 F=9999\nWAIT 1\nML X=2", "WAIT 1 in line 2 comes before the next move"),
        ("ML X=1 R=5 F=9999\nMJ J1=1", "the MJ in line 2 does not name all joints"),
        ("ML X=1 R=5 F=9999\nMJ J1=1 J2=2 SYNC=0", "with SYNC=0 each joint arrives by itself"),
        ("ML X=1 R=5 F=9999\nTANG 1\nML X=2", "TANG changes before line 3"),
        (
            "ML X=1 F=9999\nIF DI a\nML X=2\nELSE\nML X=1 R=5\nIF DI b\nENDIF\nENDIF\nML X=3",
            "IF DI b in line 6 comes before the next move",
        ),
        ("ML X=1 R=5 F=9999\nWAIT DI a\nML X=2", "WAIT DI a in line 2 comes before the next move"),
        ("LABEL a\nML X=2 F=9999\nML X=1 R=5\nWAIT 1 ; s\nGOTO a", "WAIT 1 in line 4 comes before the next move"),
    ],
)
def test_an_edge_without_effect_is_told_once_with_its_reason(text: str, why: str) -> None:
    ((line, told),) = found(text)
    assert "R=5" in text.splitlines()[line - 1]
    assert told == why


@pytest.mark.parametrize(
    "text",
    [
        "ML X=1 R=5 F=9999\nML X=2\nMJ J1=1 R=5\nML X=3 R=9\nMJ J1=1 J2=2 R=5\nMJ J1=3",
        "ML X=1 R=5 F=9999\nHOME",
        "ML X=1 F=9999\nML X=2 R=5",
        "ML X=1 R=0 F=9999\nWAIT 1\nMJ J1=1",
        "LABEL a\nML X=1 R=5 F=9999\nML X=2 R=5\nGOTO a",
    ],
)
def test_edges_that_are_made_and_stops_that_are_asked_for_are_not(text: str) -> None:
    assert found(text) == []


def test_a_cell_with_such_an_edge_is_warned_and_not_refused(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(PROGRAM, "ML X=980 F=900", "ML X=980 F=900 R=20\nWAIT 1")
    bundle, problems = check_cell(copy.cell)
    assert bundle is not None
    assert not refuses(problems)
    (problem,) = problems
    assert copy.shown(problem) == (
        f"{PROGRAM}:14:1: warning: program: found an R without effect, the robot stops: WAIT 1 in line 15 comes before "
        "the next move, allowed R where the next move can be joined; docs/language.md"
    )
