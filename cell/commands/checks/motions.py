"""What every program of a good cell does when it is planned from its first line on, before anything moves."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from cell.commands.checks.bundle import CellBundle
from cell.commands.checks.programs import place_of
from cell.commands.checks.reserve import check_reserve
from cell.config.document import read_text
from cell.config.points_file import load_points
from cell.config.problem import Problem, Severity
from robot_agent.agent.planning.dry_run import dry_run, frames_of
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import ExtendRequest, PlanFailed, Planned, PlanRequest
from robot_agent.language import (
    AwaitAnswer,
    AwaitInput,
    Decide,
    End,
    EndIf,
    Finished,
    Goto,
    If,
    Interpreter,
    LineStep,
    Meet,
    MotionStep,
    Mount,
    Move,
    Names,
    Pause,
    Program,
    ProgramFault,
    Statement,
    Step,
    TcpStep,
    Track,
    TrackingOff,
    TrackingOn,
    Ways,
    parse_program,
    points_owner,
)
from robot_agent.paths import Passing
from robot_agent.workspace import PlacedRobot

LONGEST_S = 60.0
"""Of motion, for each program."""
_MOST_STEPS = 10_000


@dataclass(frozen=True, slots=True)
class ProgramCourse:
    """How a program runs by itself: each loop twice round, no pauses, no zones, nothing that it follows.

    With both ways of each IF, in as many rounds as that takes.
    """

    robot: str
    moves: int
    """Program lines with a move that were planned."""
    duration_s: float
    """Of the longest round."""
    rests: tuple[int, ...]
    """Lines after which the robot stops although neither R=0 nor a statement asks for it."""


def check_motions(bundle: CellBundle) -> tuple[list[ProgramCourse], list[Problem]]:
    """Plan each robot's program from its home, as `cell plot` does.

    A move that cannot be planned is an error where the robot's place is known by then, and else a warning: before a
    HOME or an MJ that names all joints it is taken to be at home, and after TRACK where the path leads without it.
    Moves after such a one, and after `LONGEST_S` of motion, are a warning: nobody has looked at them.
    """
    courses, problems = [], []
    for robot in bundle.cell.robots:
        course, found = _course(bundle, robot)
        courses.append(course)
        problems += found
    return courses, problems


def _course(bundle: CellBundle, robot: str) -> tuple[ProgramCourse, list[Problem]]:
    settings, model = bundle.cell.robots[robot], bundle.robots[robot].model
    file, text = settings.program, read_text(settings.program)
    if isinstance(text, Problem):
        return ProgramCourse(robot, 0, 0.0, ()), [text]
    taught = load_points(settings.points, points_owner(bundle.cell, model.description, model.branches))
    whole = parse_program(text, file.name, Names.of(bundle.cell, robot, model.description, taught), file.parent)
    program = _once_through(whole)
    cycle_s = bundle.gateways[settings.gateway].cycle_s
    planner, ways = _Asked(bundle.robots[robot], cycle_s), Ways()
    rounds = [
        dry_run(planner, program, LONGEST_S, frames_of(bundle.cell), ways) for _ in ways.rounds(program.statements)
    ]
    motions = [planned for round_, _ in rounds for planned in round_]
    failures = {failed.line: failed for _, failed in reversed(rounds) if failed is not None}
    lines = {line for planned in motions for line in planned.lines}
    rests = sorted({line for round_, _ in rounds for line in _rests(round_)} - _asked_for(program))
    problems = [_failure(file, program, failed) for failed in failures.values()]
    problems += _not_planned(file, program, lines, failures)
    problems += check_reserve(file, program, model, motions, _paths(planner.asked))
    problems += _half_turns(file, program, {line for request in planner.asked for line in planner.half_turns(request)})
    duration_s = max(sum(planned.motion.duration_s for planned in round_) for round_, _ in rounds)
    return ProgramCourse(robot, len(lines), duration_s, tuple(rests)), problems


class _Asked(Planner):
    """A planner that keeps what it was asked for."""

    def __init__(self, robot: PlacedRobot, cycle_s: float) -> None:
        super().__init__(robot, cycle_s)
        self.asked: list[PlanRequest | ExtendRequest] = []

    def plan(self, request: PlanRequest | ExtendRequest) -> Planned | PlanFailed:
        """As `Planner`."""
        self.asked.append(request)
        return super().plan(request)


def _paths(requests: list[PlanRequest | ExtendRequest]) -> set[int]:
    """Lines with a path of the TCP; not those that may pass the wrist's singular pose by leave."""
    steps = [step for request in requests for step in request.steps if isinstance(step, TcpStep)]
    return {step.line for step in steps if not (isinstance(step, LineStep) and step.wrist_may_flip)}


def _half_turns(file: Path, program: Program, lines: Collection[int]) -> list[Problem]:
    """A warning for each line on which the tool could turn either way, since hoses may allow only one of them."""
    way = "C half-way nearer to 0 than to 180, docs/language.md"
    allowed = "that, or another orientation on the way where hoses need the other one"
    return [
        Problem(
            *place_of(program, file, line), 1, "program",
            f"{program.text_of(line)!r}: an exact half turn of the tool, which goes one fixed way of two ({way})",
            allowed, Severity.WARNING,
        )
        for line in sorted(lines)
    ]  # fmt: skip


def _once_through(program: Program) -> Program:
    """The same with each loop gone through twice: GOTO jumps back once, and without a count ends the program then.

    In a branch of an IF it goes on then, as if that had ended the loop.
    """
    places, made, within = list[int](), list[Statement](), 0
    for index, statement in enumerate(program.statements):
        places.append(len(made))
        within += isinstance(statement, If) - isinstance(statement, EndIf)
        back = isinstance(statement, Goto) and statement.target <= index
        made.append(replace(statement, count=1) if isinstance(statement, Goto) and back else statement)
        if isinstance(statement, Goto) and back and statement.count is None and not within:
            made.append(End(statement.line))
    places.append(len(made))
    return replace(program, statements=tuple(each.moved(places) for each in made))


def _rests(motions: list[Planned]) -> list[int]:
    """The line before every rest but the last."""
    within = [
        planned.lines[each.before]
        for planned in motions
        for each in planned.motion.transitions
        if each.passing is Passing.STOPS
    ]
    return within + [planned.lines[-1] for planned in motions[:-1]]


def _asked_for(program: Program) -> set[int]:
    """Lines with R=0, and those with a pause, an ATTACH, a DETACH, a TRACK or what is asked at rest after them."""
    found, ways = set[int](), Ways()
    for _ in ways.rounds(program.statements):
        interpreter, steps = Interpreter(program, ways=ways), list[Step]()
        while len(steps) < _MOST_STEPS and not (steps and isinstance(steps[-1], Finished | ProgramFault)):
            steps.append(interpreter.next())
        rests = Pause | Mount | Meet | AwaitInput | AwaitAnswer | Decide | TrackingOn | TrackingOff
        found |= {
            before.line
            for before, step in pairwise(steps)
            if isinstance(before, MotionStep) and (before.pace.round_m == 0.0 or isinstance(step, rests))
        }
    return found


def _failure(file: Path, program: Program, failed: PlanFailed) -> Problem:
    known = _place_is_known(program)
    found = f"{program.text_of(failed.line)!r}: {failed.text}; what follows was not planned"
    allowed = "a move that can be planned from where the robot is then"
    if not known:
        allowed += "; that was taken to be after home, and without what TRACK does"
    return Problem(
        *place_of(program, file, failed.line),
        1,
        "program",
        found,
        allowed,
        Severity.ERROR if known else Severity.WARNING,
    )


def _place_is_known(program: Program) -> bool:
    """Whether the program says where the robot is before its moves of the TCP, and follows nothing."""
    moves = [each for each in program.statements if isinstance(each, Move)]
    return bool(moves) and moves[0].from_anywhere and not any(isinstance(each, Track) for each in program.statements)


def _not_planned(file: Path, program: Program, planned: Collection[int], failed: Collection[int]) -> list[Problem]:
    """One warning for all moves that nobody has looked at, unless a failure before them is told already."""
    left = [each.line for each in program.statements if isinstance(each, Move) and each.line not in planned]
    if not left or failed:
        return []
    found = f"moves that were not planned, lines {listed(left)}"
    why = f"the first {LONGEST_S:g} s of motion are planned, and nothing that no line leads to"
    return [Problem(*place_of(program, file, left[0]), 1, "program", found, why, Severity.WARNING)]


def listed(lines: Collection[int]) -> str:
    """Numbers in rising order, with neighbours as from-to."""
    runs: list[list[int]] = []
    for line in sorted(lines):
        if runs and line == runs[-1][-1] + 1:
            runs[-1].append(line)
        else:
            runs.append([line])
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)
