"""Draw faults by operator: where the lot falls, not where somebody expects a fault to be found.

    python -m tests.mutants.draw --seed N [--count 20]

prints them as entries of `drawn.py`. Drawn are lines that a run of the simulated cell passes, of manager, agent, gateway
and net alike. Operators: drop a condition, turn a comparison, skip a call, swap two lines.
"""

import argparse
import ast
import itertools
import random
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

from tests.mutants.mutant import ROOT

WINGS = ("cell/manager", "robot_agent/agent", "drive_gateway/gateway", "cell/net")
_TURNED = {"<=": ">", ">=": "<", "==": "!=", "!=": "==", " is not ": " is ", " not in ": " in "}
_TURNED |= {" < ": " >= ", " > ": " <= ", " is ": " is not ", " in ": " not in "}


@dataclass(frozen=True, slots=True)
class Drawn:
    """One patch: the text of some whole lines, and what stands there instead."""

    file: str
    line: int
    operator: str
    old: str
    new: str


def passed_lines(seed: int, seconds: float) -> set[tuple[str, int]]:
    """The lines of the wings that a run of a generated cell passes: file and number."""
    from tests.sim.search import run_seed

    passed: set[tuple[str, int]] = set()
    roots = {str(ROOT / wing): wing for wing in WINGS}

    def enter(frame: FrameType, _event: str, _: Any) -> Any:
        name = frame.f_code.co_filename
        return look if any(name.startswith(root) for root in roots) else None

    def look(frame: FrameType, event: str, _: Any) -> Any:
        if event == "line":
            passed.add((str(Path(frame.f_code.co_filename).relative_to(ROOT)), frame.f_lineno))
        return look

    sys.settrace(enter)
    try:
        run_seed(seed, seconds)
    finally:
        sys.settrace(None)
    return passed


def candidates(file: str, lines: set[int]) -> Iterator[Drawn]:
    """All faults that the operators make of one file, where `lines` are passed."""
    text = (ROOT / file).read_text()
    rows = text.splitlines(keepends=True)
    tree = ast.parse(text)

    def rows_of(node: ast.stmt) -> str:
        return "".join(rows[node.lineno - 1 : node.end_lineno])

    for node in ast.walk(tree):
        if isinstance(node, ast.If | ast.While | ast.Return) and node.lineno in lines:
            test = node.value if isinstance(node, ast.Return) else node.test
            if test is not None and test.lineno == test.end_lineno:
                yield from _of_condition(file, rows[test.lineno - 1], test)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call) and node.lineno in lines:
            old = rows_of(node)
            yield Drawn(file, node.lineno, "skip a call", old, " " * node.col_offset + "pass\n")
        for body in (getattr(node, name, None) for name in ("body", "orelse")):
            if isinstance(body, list):
                for one, two in itertools.pairwise(body):
                    if one.lineno in lines and two.lineno in lines and _may_swap(one, two):
                        old = "".join(rows[one.lineno - 1 : two.end_lineno])
                        yield Drawn(file, one.lineno, "swap two lines", old, rows_of(two) + rows_of(one))


def _may_swap(one: ast.stmt, two: ast.stmt) -> bool:
    """Swapped are statements that let the next one follow, and of which one takes up what the other does."""
    if not all(
        isinstance(node, ast.Assign | ast.AugAssign | ast.If)
        or (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call))
        for node in (one, two)
    ):
        return False
    calls = all(any(isinstance(part, ast.Call) for part in ast.walk(node)) for node in (one, two))
    return calls or bool(_named(one, ast.Store) & _named(two, ast.Load))


def _named(node: ast.stmt, context: type[ast.expr_context]) -> set[str]:
    """The names and attributes that a statement reads or writes."""
    parts = [part for part in ast.walk(node) if isinstance(part, ast.Name | ast.Attribute)]
    return {part.id if isinstance(part, ast.Name) else part.attr for part in parts if isinstance(part.ctx, context)}


def _of_condition(file: str, row: str, test: ast.expr) -> Iterator[Drawn]:
    if isinstance(test, ast.BoolOp):
        word = " and " if isinstance(test.op, ast.And) else " or "
        for dropped in test.values:
            kept = word.join(ast.unparse(value) for value in test.values if value is not dropped)
            new = row[: test.col_offset] + kept + row[test.end_col_offset :]
            yield Drawn(file, test.lineno, "drop a condition", row, new)
    for part in ast.walk(test):
        if isinstance(part, ast.Compare) and len(part.ops) == 1 and part.lineno == part.end_lineno == test.lineno:
            old = row[part.col_offset : part.end_col_offset]
            for sign, turned in _TURNED.items():
                if old.count(sign) == 1:
                    new = row[: part.col_offset] + old.replace(sign, turned) + row[part.end_col_offset :]
                    yield Drawn(file, part.lineno, "turn a comparison", row, new)
                    break


def draw(seed: int, count: int, seconds: float) -> list[Drawn]:
    """So many faults, the wings and operators in turn; each patch is of text that stands in its file once."""
    rng = random.Random(seed)
    passed = passed_lines(seed, seconds)
    found: list[Drawn] = []
    for file in sorted({name for name, _ in passed}):
        text = (ROOT / file).read_text()
        of_file = candidates(file, {line for name, line in passed if name == file})
        found += [one for one in of_file if text.count(one.old) == 1 and one.old != one.new]
    drawn: list[Drawn] = []
    while len(drawn) < count:
        wing = WINGS[len(drawn) % len(WINGS)]
        operators = sorted({one.operator for one in found if one.file.startswith(wing)})
        operator = operators[len(drawn) // len(WINGS) % len(operators)]
        one = rng.choice([one for one in found if one.file.startswith(wing) and one.operator == operator])
        found.remove(one)
        drawn.append(one)
    return drawn


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants.draw", description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seconds", type=float, default=15.0, help="of cell time, to see which lines are passed")
    options = parser.parse_args()
    for number, one in enumerate(draw(options.seed, options.count, options.seconds), 1):
        print(
            f"    Mutant(\n        {f'drawn-{number:02d}'!r},\n        {f'{one.operator}, {one.file} line {one.line}'!r},"
        )
        print(
            f"        (Edit(\n            {one.file!r},\n            {one.old!r},\n            {one.new!r},\n        ),),\n    ),"
        )


if __name__ == "__main__":
    main()
