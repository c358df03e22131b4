"""A part of a program, as an operator asks for it: from a line on, up to a line, without what it switches."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from itertools import accumulate, compress

from robot_agent.language.conditions import EndIf, If
from robot_agent.language.program import Program
from robot_agent.language.sequence import End, Sub
from robot_agent.language.statement import Statement, Walk


class NotThere(Exception):
    """A program cannot begin or end at a line; the text says why, for people."""


@dataclass(frozen=True, slots=True)
class Excerpt:
    """A program, and where its walk begins."""

    program: Program
    begins: Walk


def excerpt(program: Program, first_line: int | None, last_line: int | None, *, dry: bool) -> Excerpt:
    """The program from `first_line` on, up to and with `last_line`; None: all there is before, or after, it.

    It begins with what the lines before would have made of speeds, frame, tool, spaces and all else that holds from a
    line on, each of them once and in the order of the file; variables and what is switched are not among that. With
    `dry` no output is switched. Lines of a branch or a subroutine, and lines on which something is followed, are
    neither a beginning nor an end.

    Raises:
        NotThere: there is no statement in that line, or it may not be the first or the last.
    """
    first = 0 if first_line is None else _place(program, first_line, "begin")[0]
    begins = Walk(points=program.points)
    if first:
        _hold_from(program.statements[:first], begins)
    if begins.tracking:
        raise NotThere(f"line {first_line} stands between TRACK and TRACK OFF: begin at the TRACK, or after TRACK OFF")
    begins.index, begins.switched, begins.variables = first, 0, {}
    if last_line is not None:
        last = _place(program, last_line, "end")[-1]
        if last < first:
            raise NotThere(f"line {last_line} comes before line {first_line}: end at a later line")
        program, begins.index = _ended(program, last, begins.index)
    if dry:
        program, begins.index = _quiet(program, begins.index)
    return Excerpt(program, begins)


def _place(program: Program, line: int, what: str) -> list[int]:
    """The places of the statements in a line of the program's own file. Raises NotThere."""
    statements = program.statements
    own = [place for place, each in enumerate(statements) if program.place_of(each.line)[0] == program.name]
    places = [place for place in own if statements[place].line == line]
    if not places:
        there = [int(statements[place].line) for place in own]
        near = min(there, key=lambda each: (abs(each - line), each))
        raise NotThere(f"the program cannot {what} at line {line}, which has no statement; the nearest is line {near}")
    inside = sum(isinstance(each, If) - isinstance(each, EndIf) for each in statements[: places[0]])
    if inside or isinstance(statements[places[0]], EndIf):
        raise NotThere(f"the program cannot {what} at line {line}, inside an IF: take a line before or after it")
    if places[0] not in _main(statements):
        raise NotThere(f"the program cannot {what} at line {line}, in a subroutine: take the line of its SUB")
    return places


def _main(statements: Collection[Statement]) -> set[int]:
    """Places that no subroutine alone leads to."""
    sequence = tuple(statements)
    reached, left = {0}, [0]
    while left:
        place = left.pop()
        each = sequence[place]
        following = (place + 1,) if isinstance(each, Sub) else each.leads_to(place)
        for to in following:
            if to < len(sequence) and to not in reached:
                reached.add(to)
                left.append(to)
    return reached


def _hold_from(statements: Collection[Statement], walk: Walk) -> None:
    """What holds from these on: each once, as if it had been come to; what steers the program is passed over."""
    for place, each in enumerate(statements):
        if each.leads_to(place) == (place + 1,):
            each.run(walk)


def _ended(program: Program, last: int, begin: int) -> tuple[Program, int]:
    """The program with an END after a place, and where the place `begin` is in it."""
    places = [place if place <= last else place + 1 for place in range(len(program.statements) + 1)]
    made = [each.moved(places) for each in program.statements]
    made.insert(last + 1, End(program.statements[last].line))
    return replace(program, statements=tuple(made)), places[begin]


def _quiet(program: Program, begin: int) -> tuple[Program, int]:
    """The program without what switches outputs, and where the place `begin` is in it."""
    kept = [not each.switched_outputs for each in program.statements]
    places = list(accumulate(kept, initial=0))
    made = tuple(each.moved(places) for each in compress(program.statements, kept))
    return replace(program, statements=made), places[begin]
