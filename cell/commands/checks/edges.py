"""Where moves of a program cannot be joined, whatever their directions are: why, and which round edges that costs."""

from collections.abc import Iterator
from itertools import pairwise

from robot_agent.agent.planning.joining import why_apart
from robot_agent.language import Finished, Interpreter, MotionStep, Program, ProgramFault, Step, Ways

_MOST_STEPS = 2000


def idle_edges(program: Program) -> Iterator[tuple[int, str]]:
    """Program lines whose R has no effect because the next move cannot be joined, each once, and why.

    The program is walked as it would run, both ways of each fork. At its end there is nothing to round into, and
    nothing is said.
    """
    told, ways = set[int](), Ways()
    for _ in ways.rounds(program.statements):
        for before, step in pairwise(_steps(program, ways)):
            if isinstance(before, MotionStep) and before.pace.round_m and before.line not in told:
                why = _why(program, before, step)
                if why:
                    told.add(before.line)
                    yield before.line, why


def stop_reasons(program: Program) -> dict[tuple[int, int], str]:
    """Why the robot stops between two moves whatever their directions are, for people, by the lines of both."""
    reasons, ways = dict[tuple[int, int], str](), Ways()
    for _ in ways.rounds(program.statements):
        last, why = None, ""
        for before, step in pairwise(_steps(program, ways)):
            if isinstance(before, MotionStep):
                last, why = before.line, _why(program, before, step)
            if isinstance(step, MotionStep) and last is not None and why:
                reasons[last, step.line] = why
    return reasons


def _steps(program: Program, ways: Ways) -> Iterator[Step]:
    """What the program does as it would run, until nothing new comes, without its end."""
    interpreter, walked = Interpreter(program, ways=ways), set[tuple[int, int]]()
    before_line = since_new = 0
    for _ in range(_MOST_STEPS):
        step = interpreter.next()
        if isinstance(step, Finished | ProgramFault) or since_new > len(program.statements):
            return
        yield step
        place = before_line, step.line
        since_new = since_new + 1 if place in walked else 0
        walked.add(place)
        before_line = step.line


def _why(program: Program, before: MotionStep, step: Step) -> str:
    return why_apart(before, step) if isinstance(step, MotionStep) else _between(program, step)


def _between(program: Program, step: Step) -> str:
    return f"{program.text_of(step.line)} in line {step.line} comes before the next move"
