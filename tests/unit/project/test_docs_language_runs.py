"""All that `docs/language.md` shows is run: the statements of its table within programs, and its programs."""

import functools
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cell.config.points_file import Point, PosePoint
from cell.config.settings import MountedAtStart, PoseSettings, SpaceKind, SpaceSettings, SphereShape
from cell.geometry import from_xyz_abc
from cell.messages import (
    AnswerFlag,
    Arrival,
    CellTime,
    ConveyorCount,
    Enable,
    MeetingStatus,
    Mode,
    ProgramState,
    Run,
)
from robot_agent.kinematics import Model
from robot_agent.language import Points
from robot_agent.language.statement import Statement, Walk
from robot_agent.model import Part, Tool
from robot_agent.model.description import Capsule, Mounted
from tests.unit.agent_runs import until
from tests.unit.agent_world import CYCLE_S, AgentWorld
from tests.unit.measured_world import BELT, COUNTS_PER_M
from tests.unit.project.language_page import EXAMPLES, PROGRAMS
from tests.unit.robot_agent.language.reference_programs import MODEL, placed
from tests.unit.turned_arm import flange, tcp

Numbers = NDArray[np.float64]

LENGTH_M = 0.1
"""From the flange to the TCP of each tool."""
SHELF_MM = 600.0, 500.0, 400.0
SHELF_AT = PoseSettings((0.6, 0.5, 0.4), (0.0, 0.0, 0.0, 1.0))
SHELF = SpaceSettings("shelf", SpaceKind.FORBIDDEN, SphereShape(0.05), SHELF_AT, 0.0, by_program=True)
BELT_M_S = 0.02


def tool(name: str, turned: bool) -> Tool:
    """A tool that is as long in front of the flange; where it is `turned` its TCP looks ahead along z."""
    pose = from_xyz_abc(np.array([LENGTH_M, 0.0, 0.0, 0.0, np.pi / 2 if turned else 0.0, 0.0]))
    return Tool(name, pose, 1.0, (0.1, 0.0, 0.0), 0.01 * np.eye(3), ())


CASTING = Part("casting", 2.0, (0.0, 0.0, 0.0), 0.01 * np.eye(3), (Capsule((0.0, 0.0, 0.0), (0.05, 0.0, 0.0), 0.03),))


def arm(mounted: str, turned: bool) -> Model:
    tools = {name: tool(name, turned) for name in ("gripper", "t1")}
    described = replace(MODEL.description, tools=tools, parts={"casting": CASTING})
    return type(MODEL)(replace(described, mounted=Mounted((mounted,) if mounted else ())))


def down(x_mm: float, y_mm: float, z_mm: float) -> PosePoint:
    """Where the gripper was taught, its TCP looking down."""
    return PosePoint((x_mm / 1000, y_mm / 1000, z_mm / 1000), (np.pi, 0.0, 0.0), tool="gripper")


POINTS: dict[str, Point] = {
    "above": down(900, 0, 700),
    "pick": down(900, 0, 550),
    "P1": down(900, 0, 500),
    "P2": down(900, 200, 500),
    "side": down(950, 100, 500),
}


class Shown(AgentWorld):
    """A robot that has all that the page names; whoever is asked for something answers at once."""

    def __init__(self, program: str, folder: Path, model: Model) -> None:
        super().__init__(
            program,
            arm=model,
            corrections={"belt": BELT},
            spaces=(SHELF,),
            points=Points(POINTS),
            points_file=folder / "left.points.yaml",
            mounted_at_start=MountedAtStart.AS_DESCRIBED,
        )
        self.frames = (placed("table", 850, 100, 400), placed("z1", 600, 150, 400), placed("tray", 0, 0, 50))
        self.outputs = ("gripper", "glue", "changer")
        self.inputs = {"part": True, "door": False, "good": True}
        self.met = 0
        self.ahead_m = LENGTH_M if model.description.mounted.tools else 0.0
        """From the flange to the TCP with which it begins."""

    def step(self) -> None:
        counts = round(BELT_M_S * self.now * COUNTS_PER_M) % 2**32
        self.agent.receive(ConveyorCount("line", CellTime("m", self.now), counts, None), self.now)
        waits = self.presences[-1].meets.waits if self.presences else None
        if waits is not None and waits.number > self.met:
            self.met = waits.number
            released = {"left": Arrival("boot", waits.number), "right": Arrival("other", waits.number)}
            self.meetings = {"load": MeetingStatus((), {}, released, self.now + 0.3)}
        if self.states and self.state.program.flag is not None:
            self.call(AnswerFlag(self.state.program.flag))
        super().step()

    def to_end(self) -> "Shown":
        until(self, lambda: self.states != [] and self.state.mode is Mode.DISABLED)
        self.call(Enable())
        until(self, lambda: self.state.mode is Mode.READY)
        self.call(Run())
        until(self, lambda: self.state.mode is Mode.RUNNING)
        until(self, lambda: self.state.program.state is not ProgramState.RUNNING, 120.0)
        assert self.state.program.state is ProgramState.DONE, self.state.program.error
        self.run(0.1)
        return self

    @functools.cached_property
    def places_mm(self) -> Numbers:
        """Of the TCP with which it begins, at every tick."""
        return 1000.0 * tcp(np.array(self.played), self.ahead_m)

    @property
    def switches(self) -> list[tuple[str, bool]]:
        return [(self.outputs[event.output], event.value) for _, event in self.switched]

    def comes_to(self, *expected: tuple[float, float, float]) -> None:
        """That the TCP comes to these places [mm] in this order."""
        since = 0
        for place in expected:
            away = np.linalg.norm(self.places_mm[since:] - place, axis=1)
            there = np.flatnonzero(away < NEAR_MM)
            assert len(there), f"{place} is not come to: at least {away.min():.3f} mm beside it"
            since += int(there[0])


NEAR_MM = 1.1
"""What is passed in a cycle of 4 ms at 250 mm/s, where the robot does not rest."""

FROM_HOME = "MJ X=600 Y=0 Z=400 A=180 B=0 C=0\n"


def moves(world: Shown) -> None:
    world.comes_to(
        (600, 0, 400), (600, -800, 900), (500, 100, 400), (600, 200, 400), (500, 100, 400), (500, 100, 395),
        (600, 0, 400), (550, 50, 400), (600, 0, 400), (900, 0, 700), (900, 0, 500), (950, 100, 500),
        (900, 200, 500), (850, 200, 500),
    )  # fmt: skip
    np.testing.assert_allclose(world.played[-1], MODEL.home, atol=1e-6)


def modal(world: Shown) -> None:
    world.comes_to(
        (850, 150, 400), (850, 200, 400), (600, 0, 400), (700, 0, 400), (710, 10, 400), (600, 300, 400), SHELF_MM,
        (600, 100, 400),
    )  # fmt: skip
    tangential = int(np.linalg.norm(world.places_mm - (700, 0, 400), axis=1).argmin())
    x_axis = -flange(world.played[tangential][None])[1][0, :, 2]  # the TCP's x axis is the flange's -z axis
    assert np.degrees(np.arctan2(x_axis[1], x_axis[0])) == pytest.approx(45.0, abs=0.5)
    step = np.linalg.norm(np.diff(world.places_mm, axis=0), axis=1) / CYCLE_S
    ends = int(np.linalg.norm(world.places_mm - SHELF_MM, axis=1).argmin())
    assert step[ends:].max() == pytest.approx(125.0, abs=0.5)  # SPEED 50 of F=250


def belt(world: Shown) -> None:
    """What it does not name keeps its value where each tracking ends."""
    x = world.places_mm[:, 0]
    assert x[-1] - 600.0 > 1000.0 * BELT_M_S * 0.8
    assert world.places_mm[-1, 1] == pytest.approx(0.0, abs=0.1)


def signals(world: Shown) -> None:
    assert sorted(world.switches[:2]) == [("glue", True), ("gripper", True)]
    assert world.switches == [("glue", True), ("gripper", True), ("glue", False), ("gripper", False)]
    (first, _), (last, _) = world.switched[0], world.switched[2]
    assert world.places_mm[first - 2, 1] == pytest.approx(150.0, abs=NEAR_MM)
    assert 0.0 < world.places_mm[last - 2, 1] < 50.0
    assert (world.met, world.state.program.raised) == (2, {"7": 1})


def counted(world: Shown) -> None:
    assert world.state.program.variables == {"n": 8.0}
    assert np.degrees(world.commanded[0]) == pytest.approx(5.0)


def called(world: Shown) -> None:
    assert world.state.program.variables == {"n": 8.0}


def late(world: Shown) -> None:
    """The input is on all the time, so it goes on at the label, and is not on the way there."""
    assert np.degrees(world.commanded[0]) == pytest.approx(10.0)
    assert np.degrees(np.array(world.played)[:, 0]).max() < 10.1


def changed(world: Shown) -> None:
    assert (world.state.tool, world.state.part) == ("", "")
    assert {state.tool for state in world.states} == {"gripper", "t1", ""}
    assert {state.part for state in world.states} == {"", "casting"}


TABLE: dict[str, tuple[str, Callable[[Shown], None]]] = {
    "moves": (
        """MJ J1=10 J2=-20 F=50
MJ X=600 Y=0 Z=400 A=180 B=0 C=0
MJ Y=-800 Z=700
MJ X=600 Z=900 J1=0
MJ X=500 Y=100 Z=400
MC QX=600 QY=100 QZ=400 X=600 Y=200 Z=400 F=250
ML X=500 Y=100
MC QX=600 QY=100 X=600 Y=200 H=720 LIFT=-5 F=250
ML X=600 Y=0 Z=400 A=180 B=0 C=0 F=250
ML X=550 Y=50 R=0
MS X=600 Y=0 Z=400 F=250
MJ P=above
ML P1 F=250
MC P2 Q=side F=100
ML X=0 Z=table F=100
HOME F=30
END""",
        moves,
    ),
    "modal": (
        FROM_HOME
        + """Z=table
ML X=0 Y=50 Z=0 F=250
Z1
ML Y=50
Z0
ML X=600 Y=0
TANG 1 H=45
ML X=700
TANG 0
TOL 0.05
ML X=705 Y=2
ML X=710 Y=10
TOL 0.05 ANGLE 0.5
ML X=705 Y=12
TOL 0
ML X=600 Y=300
SPACE shelf OFF
ML X=600 Y=500
SPEED 50
ML Y=100
SPACE shelf ON
END""",
        modal,
    ),
    "belt": (
        FROM_HOME + "TRACK belt\nML Y=50 F=100\nTRACK OFF\nTRK belt\nML Y=0\nTRACK OFF\nWAIT 0.5\nEND",
        belt,
    ),
    "signals": (
        FROM_HOME
        + """ML Y=200 F=250
SET DO glue BEFORE 50 MM
SET DO gripper
ML Y=0
RESET DO glue BEFORE 0.2 S
RESET DO gripper
WAIT 0.5
WAIT DI part
M 7
LOOKAHEAD 1
IF DI part AND NOT DI door
ML Y=50
ELSE
ENDIF
M 7 ASYNC
LOOKAHEAD 0
ML Y=0
MEET load
MEET load TIMEOUT 30
END""",
        signals,
    ),
    "counted": (
        """LET n = 0
LABEL name
MJ J1=5
LET n = n + 1
GOTO name 3
IF n < 3
MJ J1=10
ELSE
IF n < 8
GOTO name
ELSE
ENDIF
ENDIF
END""",
        counted,
    ),
    "called": (
        """LET n = 0
SUB name
SUB name 3
CALL cut.prog
CALL cut.prog 3
END
LABEL name
MJ J1=1
LET n = n + 1
END""",
        called,
    ),
    "late": ("MJ J1=5\nWAIT DI part OFF TIMEOUT 5 GOTO name\nMJ J1=20\nLABEL name\nMJ J1=10\nEND", late),
    "changed": ("T1\nMJ J1=1\nT=gripper\nATTACH casting\nMJ J1=2\nDETACH\nT0\nMJ J1=3\nEND", changed),
}


@pytest.fixture
def ran(monkeypatch: pytest.MonkeyPatch) -> set[int]:
    """The lines whose statements are run, while programs run."""
    lines: set[int] = set()

    def noting(run: Callable[[Statement, Walk], object]) -> Callable[[Statement, Walk], object]:
        def noted(statement: Statement, walk: Walk) -> object:
            lines.add(int(statement.line))
            return run(statement, walk)

        return noted

    kinds = set(Statement.__subclasses__())
    kinds |= {each for kind in kinds for each in kind.__subclasses__()}
    for kind in kinds:
        monkeypatch.setattr(kind, "run", noting(kind.run))
    return lines


def test_every_statement_of_the_table_is_in_a_program_that_is_run() -> None:
    assert set(EXAMPLES) <= {line for text, _ in TABLE.values() for line in text.splitlines()}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.soak if name in ("moves", "modal") else ()) for name in TABLE]
)
def test_the_statements_of_the_table_do_what_it_says(name: str, tmp_path: Path, ran: set[int]) -> None:
    (tmp_path / "cut.prog").write_text("MJ J1=2\nLET n = n + 1\n")
    text, holds = TABLE[name]
    world = Shown(text, tmp_path, arm("gripper", turned=True)).to_end()
    holds(world)
    shown = [line for line, written in enumerate(text.splitlines(), 1) if written in EXAMPLES]
    passed_by = {"LABEL", "ELSE"}  # jumps lead behind them
    assert {line for line in shown if text.splitlines()[line - 1].split()[0] not in passed_by} <= ran


# The programs of the page


def corner(world: Shown) -> None:
    """Three times to and fro, from home."""
    j1 = np.degrees(np.array(world.played)[:, 0])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(j1[np.append(True, np.diff(j1) != 0.0)]))))
    assert (len(turns), j1.max()) == (5, pytest.approx(20.0, abs=0.01))
    assert j1[-1] == pytest.approx(10.0)


def points(world: Shown) -> None:
    """The last one is 50 mm higher in the frame `tray`."""
    world.comes_to((900, 0, 700), (900, 0, 550), (950, 100, 500), (900, 200, 500), (900, 0, 600))
    np.testing.assert_allclose(world.places_mm[-1], (900, 0, 600), atol=1e-3)


def many_short_lines(world: Shown) -> None:
    """Within 0.05 mm of the polygon, without a stop in it."""
    corners = np.array([[1000, 0, 1350], [1000, 0.499, 1350.02], [1000, 0.995, 1350.08], [1000, 1.486, 1350.18]])
    begins = int(np.linalg.norm(world.places_mm - corners[0], axis=1).argmin())
    path = world.places_mm[begins:]
    away = np.full(len(path), np.inf)
    for first, last in pairwise(corners):
        share = np.clip((path - first) @ (last - first) / ((last - first) @ (last - first)), 0.0, 1.0)
        away = np.minimum(away, np.linalg.norm(path - first - share[:, None] * (last - first), axis=1))
    assert away.max() < 0.05
    speed = np.linalg.norm(np.diff(path, axis=0), axis=1)
    moving = np.flatnonzero(speed > 1e-6)
    assert len(moving) == moving[-1] - moving[0] + 1
    np.testing.assert_allclose(path[-1], corners[-1], atol=1e-3)


def ten_parts(world: Shown) -> None:
    assert world.state.program.variables == {"parts": 10.0}
    j1 = np.degrees(np.array(world.played)[:, 0])
    assert ((j1 > 19.99) & np.append(True, j1[1:] != j1[:-1])).sum() >= 10
    assert j1.min() > -1e-6
    np.testing.assert_allclose(world.played[-1], MODEL.home, atol=1e-6)


def fetched(world: Shown) -> None:
    """The flange goes down to 300 mm, then the TCP, which is below it, up to 800 mm."""
    assert world.places_mm[:, 2].min() == pytest.approx(300.0, abs=1e-3)
    assert world.places_mm[-1, 2] == pytest.approx(800.0 + 1000.0 * LENGTH_M, abs=1e-3)
    assert world.state.tool == "gripper"
    assert world.switches == [("changer", True)]


def attached(world: Shown) -> None:
    assert (world.state.part, world.places_mm[-1, 2]) == ("casting", pytest.approx(1200.0, abs=1e-3))
    assert world.places_mm[:, 2].min() == pytest.approx(900.0, abs=1e-3)
    assert world.switches == [("gripper", True)]


def example(world: Shown) -> None:
    """Three times straight down and up."""
    z = world.places_mm[:, 2]
    low = np.flatnonzero((z[1:] <= 1900.0 + 1e-6) & (z[:-1] > 1900.0 + 1e-6)) + 1
    assert len(low) == 3
    for down in low:
        before = world.places_mm[down - 100 : down + 1]
        assert before[0, 2] > 1950.0
        assert np.ptp(before[:, :2], axis=0).max() < 1e-3
    np.testing.assert_allclose(world.played[-1], MODEL.home, atol=1e-6)


FRAGMENTS: tuple[tuple[str, str, str, Callable[[Shown], None]], ...] = (
    ("", "HOME F=60\nSUB corner 3", "gripper", corner),
    ("MJ X=900 Y=-300 Z=700 A=180 B=0 C=0\n", "MJ P=above F=50", "turned", points),
    ("", "MJ J1=0 J2=-12", "", many_short_lines),
    ("", "LET parts = 0", "gripper", ten_parts),
    ("MJ X=1000 Y=0 Z=500 A=0 B=90 C=0\n", "ML Z=300 F=100", "", fetched),
    ("MJ X=1400 Y=0 Z=1000 A=0 B=90 C=0\n", "ML Z=900 F=200", "gripper", attached),
    ("", "HOME F=60                       ; start", "gripper", example),
)
"""What stands before a program of the page, its beginning, the tool, and what it does."""


def test_every_program_of_the_page_is_run() -> None:
    assert [program[: len(begins)] for program, (_, begins, _, _) in zip(PROGRAMS, FRAGMENTS, strict=True)] == [
        begins for _, begins, _, _ in FRAGMENTS
    ]


@pytest.mark.parametrize(
    "number", [pytest.param(each, marks=pytest.mark.soak if each in (1, 3, 4, 6) else ()) for each in range(7)]
)
def test_the_programs_of_the_page_run(number: int, tmp_path: Path) -> None:
    before, _, mounted, holds = FRAGMENTS[number]
    model = arm("gripper" if mounted else "", turned=mounted == "turned")
    holds(Shown(before + PROGRAMS[number], tmp_path, model).to_end())
