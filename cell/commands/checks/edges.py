"""Round edges that a program asks for and no robot can make."""

from collections.abc import Iterator

from robot_agent.agent.joining import why_apart
from robot_agent.language import Finished, Interpreter, MotionStep, Program, ProgramFault, Step

_MOST_STEPS = 2000


def idle_edges(program: Program) -> Iterator[tuple[int, str]]:
    """Program lines whose R has no effect because the next move cannot be joined, each once, and why.

    The program is walked as it would run. At its end there is nothing to round into, and nothing is said.
    """
    interpreter, told, walked = Interpreter(program), set[int](), set[tuple[int, int]]()
    before: Step | None = None
    since_new = 0
    for _ in range(_MOST_STEPS):
        step = interpreter.next()
        if isinstance(step, Finished | ProgramFault) or since_new > len(program.statements):
            return
        if isinstance(before, MotionStep) and before.pace.round_m and before.line not in told:
            why = why_apart(before, step) if isinstance(step, MotionStep) else _between(program, step)
            if why:
                told.add(before.line)
                yield before.line, why
        place = (0 if before is None else before.line, step.line)
        since_new = since_new + 1 if place in walked else 0
        walked.add(place)
        before = step


def _between(program: Program, step: Step) -> str:
    return f"{program.text_of(step.line)} in line {step.line} comes before the next move"
