"""Program text to statements. All mistakes are found in one pass and reported together."""

import re
from collections.abc import Collection

from robot_agent.language.program import Program, ProgramError, ProgramProblem
from robot_agent.language.statement import STATEMENTS, Reading, Statement
from robot_agent.language.words import Mistake, Word

_WORD = re.compile(r"[^\s=]+(?:\s*=\s*[^\s=]+)?")


def parse_program(
    text: str,
    name: str,
    joint_names: tuple[str, ...],
    linear: Collection[str] = frozenset(),
    corrections: Collection[str] | None = None,
    outputs: Collection[str] | None = None,
    spaces: Collection[str] | None = None,
    parts: Collection[str] | None = None,
    meetings: Collection[str] | None = None,
) -> Program:
    """Parse a program.

    `joint_names` are the joints that `MJ` may name; joint values are degrees, or millimetres for the joints in
    `linear`, lengths millimetres, speeds percent of the joint limits (`MJ`, `HOME`) or mm/s (`ML`, `MC`, `MS`).
    `corrections` are the names that `TRACK` may use, `outputs` those of `SET DO` and `RESET DO`, `spaces` those of
    `SPACE`, `parts` those of `ATTACH`, `meetings` those of `MEET`, `None` for any.
    Raises `ProgramError` with every mistake.
    """
    reading = Reading(joint_names, linear, corrections, outputs, spaces, parts, meetings)
    lines, statements, problems = text.splitlines(), list[Statement](), list[ProgramProblem]()

    def wrong(line: int, mistake: Mistake) -> None:
        problems.append(ProgramProblem(line, mistake.column, _visible(mistake.found), mistake.allowed))

    for line, written in enumerate(lines, 1):
        words = [Word(m.group(), m.start() + 1) for m in _WORD.finditer(written.split(";")[0])]
        if not words:
            continue
        try:
            reading.place = len(statements)
            statements.append(_kind(words[0]).read(line, words, reading))
        except Mistake as mistake:
            wrong(line, mistake)
    for index, make in reading.linked:
        try:
            statements[index] = make()
        except Mistake as mistake:
            wrong(statements[index].line, mistake)
    if not statements and not problems:
        problems.append(ProgramProblem(1, 1, "a program without statements", "at least one statement"))
    if problems:
        raise ProgramError(name, tuple(sorted(problems, key=lambda p: (p.line, p.column))))
    return Program(name, tuple(statements), tuple(lines))


def _kind(head: Word) -> type[Statement]:
    kind = STATEMENTS.get(head.text.upper())
    if kind is None:
        raise Mistake(head.column, f"`{head.text}`", f"one of {', '.join(STATEMENTS)}")
    return kind


def _visible(text: str) -> str:
    """Characters that nobody sees by their number, as an editor for programs shows them."""
    return "".join(each if each.isprintable() else f"<U+{ord(each):04X}>" for each in text)
