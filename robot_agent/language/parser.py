"""Program text to statements. All mistakes are found in one pass and reported together."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

from cell.config.document import read_text
from cell.config.problem import Problem, near
from robot_agent.language.flow import mistakes_of_flow
from robot_agent.language.gcode import is_cam, statements_of
from robot_agent.language.names import Names, Points
from robot_agent.language.program import CalledLine, Program, ProgramError, ProgramProblem
from robot_agent.language.sequence import End
from robot_agent.language.statement import STATEMENTS, Reading, Statement
from robot_agent.language.words import COMMENT, Mistake, Word, statements_in, tool_first


def parse_program(text: str, name: str, names: Names, folder: Path | None = None) -> Program:
    """Parse a program.

    Joint values are degrees or millimetres, lengths millimetres, speeds percent of the joint limits (`MJ`, `HOME`) or
    mm/s (`ML`, `MC`, `MS`). What `CALL` names is read from `folder`; a file is G-code by its name.
    Raises `ProgramError` with every mistake, those in files that are called too.
    """
    reader = _Reader(names, folder)
    reader.read(text, name)
    reader.link()
    if not reader.statements and not reader.problems:
        reader.problems.append(ProgramProblem(1, 1, "a program without statements", "at least one statement"))
    if not reader.problems:
        reader.problems += mistakes_of_flow(reader.statements, reader.ends)
    if reader.problems:
        problems = sorted(reader.problems, key=lambda each: (each.file, each.line, each.column))
        raise ProgramError(name, tuple(problems))
    return Program(name, tuple(reader.statements), tuple(reader.lines), names.points or Points())


class _Reader:
    """Reads a file, then those that it calls, each once; their statements come after its own."""

    def __init__(self, names: Names, folder: Path | None) -> None:
        self.statements: list[Statement] = []
        self.lines: list[str] = []
        self.problems: list[ProgramProblem] = []
        self.ends: list[int] = []
        """Places after the last statement of each file."""
        self._names, self._folder = names, folder
        self._linked: list[tuple[str, int, int, Callable[[], Statement]]] = []
        """File, lines before it, place and maker of each statement that is made once all are read."""
        self._variables: set[str] = set()
        self._begins: dict[str, int] = {}
        """Files that are called: the place of their first statement."""

    def read(self, text: str, name: str, called: bool = False) -> None:
        """The statements of one file, and of those that it calls."""
        lines, before = text.splitlines(), len(self.lines)
        reading = Reading(self._names, self._begins, variables=self._variables)
        file = name if called else ""
        self.lines += lines
        for number, column, words in self._statements(text, name, file):
            line = CalledLine(before + number, name, number) if called else number
            reading.place = len(self.statements)
            try:
                self.statements.append(_kind(words[0]).read(line, words, reading))
            except Mistake as mistake:
                self._wrong(file, number, Mistake(column or mistake.column, mistake.found, mistake.allowed))
        self.ends.append(len(self.statements))
        if called or reading.files:
            self.statements.append(End(line=before + max(len(lines), 1)))
        for column, number_of, wanted in ((word.column, line, word.text) for line, word in reading.files):
            if wanted not in self._begins:
                self._call(wanted, file, int(number_of) - before, column)
        self._linked += [(file, before, place, make) for place, make in reading.linked]

    def _statements(self, text: str, name: str, file: str) -> Iterator[tuple[int, int, list[Word]]]:
        """Line and words of each statement of a file, and of G-code the column of what it comes from, else 0."""
        if is_cam(name):
            for line, column, written in statements_of(text, self._names.cam, partial(self._wrong, file)):
                for words in statements_in(written):
                    yield line, column, words
            return
        for line, written in enumerate(text.splitlines(), 1):
            for whole in statements_in(COMMENT.split(written, maxsplit=1)[0]):
                for words in tool_first(whole, self._names.joints):
                    yield line, 0, words

    def link(self) -> None:
        """Make the statements that had to wait for labels, variables and files."""
        for file, before, place, make in self._linked:
            try:
                self.statements[place] = make()
            except Mistake as mistake:
                self._wrong(file, self.statements[place].line - before, mistake)

    def _call(self, wanted: str, file: str, line: int, column: int) -> None:
        if self._folder is None:
            self._wrong(file, line, Mistake(column, f"CALL {wanted}", "no CALL: this program is no file"))
            return
        text = read_text(self._folder / wanted)
        if isinstance(text, Problem):
            self._wrong(file, line, Mistake(column, f"CALL {wanted}: {text.found}", text.allowed))
            return
        self._begins[wanted] = len(self.statements)
        self.read(text, wanted, called=True)

    def _wrong(self, file: str, line: int, mistake: Mistake) -> None:
        self.problems.append(ProgramProblem(line, mistake.column, _visible(mistake.found), mistake.allowed, file))


def _kind(head: Word) -> type[Statement]:
    kind = STATEMENTS.get(head.statement)
    if kind is None:
        raise Mistake(head.column, f"`{head.text}`", near(head.text, STATEMENTS, ""))
    return kind


def _visible(text: str) -> str:
    """Characters that nobody sees by their number, as an editor for programs shows them."""
    return "".join(each if each.isprintable() else f"<U+{ord(each):04X}>" for each in text)
