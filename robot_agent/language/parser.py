"""Program text to statements. All mistakes are found in one pass and reported together."""

import re

from robot_agent.language.names import Names
from robot_agent.language.program import Program, ProgramError, ProgramProblem
from robot_agent.language.statement import STATEMENTS, Reading, Statement
from robot_agent.language.words import Mistake, Word

_WORD = re.compile(r"[^\s=]+(?:\s*=\s*[^\s=]+)?")


def parse_program(text: str, name: str, names: Names) -> Program:
    """Parse a program.

    Joint values are degrees or millimetres, lengths millimetres, speeds percent of the joint limits (`MJ`, `HOME`) or
    mm/s (`ML`, `MC`, `MS`).
    Raises `ProgramError` with every mistake.
    """
    reading = Reading(names)
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
    kind = STATEMENTS.get(head.statement)
    if kind is None:
        raise Mistake(head.column, f"`{head.text}`", f"one of {', '.join(STATEMENTS)}")
    return kind


def _visible(text: str) -> str:
    """Characters that nobody sees by their number, as an editor for programs shows them."""
    return "".join(each if each.isprintable() else f"<U+{ord(each):04X}>" for each in text)
