"""CAM files: what G-code comes down to, and what of it is refused."""

import math
import random
import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.config.points_file import CamSettings, PointsOwner, load_points
from robot_agent.language import (
    ArcStep,
    Finished,
    Interpreter,
    JointStep,
    LineStep,
    Names,
    Program,
    ProgramError,
    Step,
    parse_program,
)
from robot_agent.language.gcode import _GROUPS, statements_of
from robot_agent.language.words import Mistake
from robot_agent.paths import Arc, Line
from robot_agent.paths.arc import evenly_turned
from robot_agent.paths.legs import legs
from tests.unit.repository import ROOT
from tests.unit.robot_agent.language.gcode_oracle import Stroke, strokes

CODES = {
    "M3": ("SET DO spindle", "WAIT 0.5"), "M4": ("SET DO spindle",), "M5": ("RESET DO spindle",), "M8": (), "M9": (),
    "S": (), "T1": (), "T2": ("CALL change.prog",),
}  # fmt: skip
CAM = CamSettings(rapid_mm_s=100.0, codes=CODES)
FILES = sorted((ROOT / "tests" / "vectors" / "cam").iterdir())
SHARES = np.linspace(0.0, 1.0, 33)


def lines(text: str, cam: CamSettings = CAM) -> list[str]:
    """The statements of a file without mistakes, each with its line."""
    wrong: list[tuple[int, str]] = []
    made = [
        f"{line}: {said}" for line, _, said in statements_of(text, cam, lambda at, each: wrong.append((at, str(each))))
    ]
    assert wrong == []
    return made


def mistakes(text: str, cam: CamSettings = CAM) -> list[str]:
    found: list[str] = []

    def wrong(line: int, mistake: Mistake) -> None:
        found.append(f"{line}:{mistake.column}: {mistake.found}, allowed {mistake.allowed}")

    list(statements_of(text, cam, wrong))
    return found


def parsed(text: str, folder: Path | None = None) -> Program:
    return parse_program(text, "part.nc", Names(("J1", "J2"), cam=CAM), folder)


def steps_of(program: Program) -> list[Step]:
    interpreter, made = Interpreter(program), list[Step]()
    while not isinstance(step := interpreter.next(), Finished):
        assert not isinstance(step, JointStep)
        made.append(step)
    return made


def moved(program: Program) -> list[Stroke]:
    """The moves of a program behind its first, as the robot goes: the legs that its motions are made of."""
    pose: np.ndarray | None = None
    made: list[Stroke] = []
    for step in steps_of(program):
        if not isinstance(step, LineStep | ArcStep):
            continue
        target = placed(step.position_m)
        if pose is None:
            pose = target
            continue
        if isinstance(step, LineStep):
            block: Line | Arc = Line(target, step.pace.speed_m_s, step.line)
        else:
            via = evenly_turned(pose, placed(step.via_position_m), target)
            block = Arc(via, target, step.line, step.angle_rad, step.pace.speed_m_s, step.lift_m)
        for leg in legs([(0, block)], pose):
            places = leg.curve.at(SHARES * leg.curve.length_m)[0]
            pose = placed(tuple(places[-1]))
            made.append(Stroke(step.line, places, step.pace.speed_m_s))
    return made


def placed(position_m: tuple[float | None, float | None, float | None]) -> np.ndarray:
    assert None not in position_m
    pose = np.eye(4)
    pose[:3, 3] = position_m
    return pose


def assert_alike(text: str, folder: Path | None = None) -> None:
    """What the product moves is what the oracle reads, place by place and feed by feed."""
    ours, oracle = moved(parsed(text, folder)), strokes(text)
    assert [each.line for each in ours] == [each.line for each in oracle]
    for mine, theirs in zip(ours, oracle, strict=True):
        np.testing.assert_allclose(mine.places, theirs.places, rtol=0.0, atol=1e-9, err_msg=f"line {mine.line}")
        feed = CAM.rapid_mm_s / 1000.0 if theirs.feed_m_s is None else theirs.feed_m_s
        assert mine.feed_m_s == pytest.approx(feed, rel=1e-8)


# Geometry against the oracle

ROUND = [0.0, 0.25, 0.5, 1.0, -1.0]
"""Turns, besides any: whole circles, half ones and quarters are what people write."""


class Author:
    """Writes files at random whose arcs are as exact as their numbers; it holds what the words before have led to."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self.at = [0.0, 0.0, 0.0]
        self.unit, self.relative, self.absolute, self.plane = 1.0, False, False, 17

    def file(self, blocks: int) -> str:
        written = ["%", "G21 (all in mm)", "G0 X0 Y0 Z0", "F600"]
        for _ in range(blocks):
            written.append(self._dressed(f"{self._modes()} {self._arc() if self.rng.random() < 0.6 else self._line()}"))
        return "\n".join([*written, "M30", "G1 X999", ""])

    def _modes(self) -> str:
        """Some of what holds on, and the feed in the unit that it has then."""
        draw, words = self.rng.random, list[str]()
        if draw() < 0.25:
            self.unit = self.rng.choice([1.0, 25.4])
            words += ["G21" if self.unit == 1.0 else "G20", f"F{self.rng.choice([12, 30.5, 100])}"]
        if draw() < 0.25:
            self.relative = not self.relative
            words.append("G91" if self.relative else "G90")
        if draw() < 0.25:
            self.absolute = not self.absolute
            words.append("G90.1" if self.absolute else "G91.1")
        if draw() < 0.25:
            self.plane = self.rng.choice([17, 18, 19])
            words.append(f"G{self.plane}")
        return " ".join(words)

    def _line(self) -> str:
        axes = self.rng.sample(range(3), self.rng.randint(1, 3))
        goal = [self._length() if axis in axes else value for axis, value in enumerate(self.at)]
        return f"G{self.rng.choice([0, 1])} {self._to(goal, axes)}"

    def _arc(self) -> str:
        first, second, third = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}[self.plane]
        sense = self.rng.choice([1.0, -1.0])
        radius, angle = abs(self._length()) + 0.1, self.rng.uniform(-math.pi, math.pi)
        turns = abs(self.rng.choice([*ROUND, *(self.rng.uniform(0.001, 0.999) for _ in range(5))])) or 1.0
        centre = [self.at[first] - radius * math.cos(angle), self.at[second] - radius * math.sin(angle)]
        goal = self.at.copy()
        if turns < 1.0:
            goal[first] = centre[0] + radius * math.cos(angle + sense * math.tau * turns)
            goal[second] = centre[1] + radius * math.sin(angle + sense * math.tau * turns)
        if self.rng.random() < 0.4:
            goal[third] += self.rng.choice([1.0, -3.0, self.rng.uniform(-20.0, 20.0)]) * radius
        offsets = [(value if self.absolute else value - self.at[axis]) / self.unit
                   for value, axis in zip(centre, (first, second), strict=True)]  # fmt: skip
        by_radius = turns < 1.0 and abs(turns - 0.5) > 0.01 and self.rng.random() < 0.4
        middle = [f"R{math.copysign(radius, 0.5 - turns) / self.unit:.12f}"]
        if not by_radius:
            named = zip(("IJK"[first], "IJK"[second]), offsets, strict=True)
            middle = [f"{letter}{value:.12f}" for letter, value in named]
        axes = [axis for axis in (first, second, third) if by_radius or goal[axis] != self.at[axis]]
        return f"G{3 if sense > 0.0 else 2} {self._to(goal, axes)} {' '.join(middle)}"

    def _to(self, goal: list[float], axes: list[int]) -> str:
        before, self.at = self.at, goal
        values = {axis: (goal[axis] - before[axis] if self.relative else goal[axis]) / self.unit for axis in axes}
        return " ".join(f"{'XYZ'[axis]}{value:.12f}" for axis, value in values.items())

    def _length(self) -> float:
        return self.rng.choice([0.0, 1.0, -1.0, 10.0, 0.002, 25.4, self.rng.uniform(-200, 200), self.rng.gauss(0, 1)])

    def _dressed(self, block: str) -> str:
        """The same in another hand."""
        dress = self.rng.choice([
            str.lower, lambda text: text.replace(" ", ""), lambda text: f"N10 {text} (X5)", lambda text: f"{text} ; X5",
            lambda text: text.replace("G", "G0").replace("G090.1", "G90.1"), lambda text: text.replace("X", " X "),
        ])  # fmt: skip
        return dress(block)


@settings(max_examples=80, deadline=None)
@given(st.integers(0, 2**32), st.integers(1, 12))
def test_every_file_is_the_path_that_the_standard_means(seed: int, blocks: int) -> None:
    assert_alike(Author(seed).file(blocks))


@pytest.mark.parametrize("file", FILES, ids=lambda each: each.name)
def test_files_in_the_manner_of_cam_systems_are_the_path_that_the_standard_means(file: Path, tmp_path: Path) -> None:
    (tmp_path / "change.prog").write_text("WAIT 1\n")
    first, *others = file.read_text().splitlines()
    assert set(first) <= {"%"} or first.startswith(";")
    assert_alike("\n".join(["G0 X1 Y2 Z3", *others]), tmp_path)


@pytest.mark.parametrize(
    "arc",
    [
        "G2 X20 Y0 R10", "G3 X20 Y0 R-10", "G3 I10", "G2 X0 Y0 I10 J0", "G3 X20 I10 Z-5", "G2 X10 Y10 I10",
        "G18 G2 X20 Z0 I10 K0 Y3", "G19 G3 Z20 Y0 J0 K10", "G20 G3 X1 R.5", "G91 G2 Y10 J5", "G90.1 G3 X20 I10 J0",
    ],
)  # fmt: skip
def test_round_numbers(arc: str) -> None:
    assert_alike(f"G0 X0 Y0 Z0\n{arc} F60\nG1 X7")


def test_an_arc_whose_numbers_are_rounded_ends_where_it_says() -> None:
    made = moved(parsed("G0 X0 Y0 Z0\nG3 X7.071 Y2.929 I0 J10 F60\nG2 X7.0712 Y2.929 I-7.071 J7.071"))
    np.testing.assert_allclose(made[0].places[-1], [0.007071, 0.002929, 0.0], atol=1e-12)
    # nearly a whole circle: by its angle, so that rounding does not tilt it
    np.testing.assert_allclose(made[1].places[-1], [0.0070712, 0.002929, 0.0], atol=2e-7)
    np.testing.assert_allclose(made[1].places[16], [-0.007071, 0.017071, 0.0], atol=3e-7)


# What blocks come down to

AT = "G0 X0 Y0 Z0 F600\n"


def behind(blocks: str, cam: CamSettings = CAM) -> list[str]:
    """The statements of blocks behind a first one, without its own."""
    return [each.split(": ")[1] for each in lines(AT + blocks, cam)[1:]]


def test_rapid_moves_are_lines_at_a_speed_of_their_own_and_f_is_said_where_it_changes() -> None:
    assert lines("G0 X1 Y2 Z3\nX4\nG1 Y5 F600\nY6\nG0 X0\nG1 X1") == [
        "1: ML X=1 Y=2 Z=3 F=100", "2: ML X=4 Y=2 Z=3", "3: ML X=4 Y=5 Z=3 F=10", "4: ML X=4 Y=6 Z=3",
        "5: ML X=0 Y=6 Z=3 F=100", "6: ML X=1 Y=6 Z=3 F=10",
    ]  # fmt: skip


def test_inches_hold_for_places_and_feeds_and_for_the_whole_block() -> None:
    assert behind("X1 F60 G20 G1\nG21 X1") == ["ML X=25.4 Y=0 Z=0 F=25.4", "ML X=1 Y=0 Z=0"]


def test_a_place_that_is_not_said_is_where_the_robot_is() -> None:
    assert lines("G0 Z5\nX1 Y2\nG1 X3 F60") == ["1: ML Z=5 F=100", "2: ML X=1 Y=2 Z=5", "3: ML X=3 Y=2 Z=5 F=1"]


def test_a_move_to_where_the_tool_is_is_none() -> None:
    assert behind("G1\nX0\nG91 X0 Y0\nG1 F1200\nX1") == ["ML X=1 Y=0 Z=0 F=20"]


def test_a_b_and_c_are_the_orientation_and_hold_on() -> None:
    assert behind("G1 X1 A0 B90 C10\nX2\nC20\nG91 C-5 X1") == [
        "ML X=1 Y=0 Z=0 A=0 B=90 C=10 F=10", "ML X=2 Y=0 Z=0", "ML X=2 Y=0 Z=0 A=0 B=90 C=20 FA=10",
        "ML X=3 Y=0 Z=0 A=0 B=90 C=15",
    ]  # fmt: skip
    assert (
        behind("A0 B0 C5\nG2 X10 Y10 I10 C15")[1]
        == "MC QX=2.928932188 QY=7.071067812 QZ=0 X=10 Y=10 Z=0 A=0 B=0 C=15 F=10"
    )


def test_codes_are_what_the_points_file_says_before_the_move_of_their_block() -> None:
    assert behind("M3 S500 G1 X1\nM5") == ["SET DO spindle", "WAIT 0.5", "ML X=1 Y=0 Z=0 F=10", "RESET DO spindle"]
    assert behind("G1 X1 M0\nM01") == ["ML X=1 Y=0 Z=0 F=10", "M 0", "M 1"]
    assert behind("M1\nM7\nM9", CamSettings(codes={"M1": (), "M7": ("M 7 ASYNC",), "M9": ()})) == ["M 7 ASYNC"]


@pytest.mark.parametrize("end", ["M2", "m30", "G0 X0 M30"])
def test_the_end_of_a_program_switches_off_what_it_has_switched_on(end: str) -> None:
    assert behind(f"M3\n{end}\nG1 X9")[-1] == "RESET DO spindle"
    assert "RESET DO spindle" not in behind(f"M3\nM5\n{end}")[4:]


def test_after_a_tool_change_the_robot_is_anywhere() -> None:
    assert behind("G1 X1 A0 B0 C0\nT2 M6\nG1 X1")[1:] == ["CALL change.prog", "ML X=1 Y=0 Z=0 A=0 B=0 C=0 F=10"]
    assert mistakes(f"{AT}T2 M6\nG2 I5") == [
        "3:4: G2 from a place that the file has not said, allowed G0 or G1 to X, Y and Z before it, after a change of "
        "the tool too"
    ]


def test_a_dwell_waits_and_path_modes_are_a_tolerance() -> None:
    assert behind("G4 P.5") == ["WAIT 0.5"]
    assert behind("G64\nG61\nG61.1\nG20\nG64 P.001 Q.002") == ["TOL 0.05", "TOL 0", "TOL 0.0254"]


@pytest.mark.parametrize(
    ("block", "same"),
    [
        ("x1y2", "X1 Y2"), ("N10X1.Y+.5", "X1 Y0.5"), ("X 1 (to Y9) Y2 ; Z3", "X1 Y2"), ("(a)X1(b)Y2(c)", "X1 Y2"),
        ("/X1", "X1"), ("G01X001", "G1 X1"), ("g00g90 x-.5", "G0 X-0.5"), ("\tX1\r", "X1"),
    ],
)  # fmt: skip
def test_blocks_may_be_written_in_many_ways(block: str, same: str) -> None:
    assert behind(f"G1\n{block}") == behind(f"G1\n{same}")


def test_blocks_with_a_slash_are_left_out_where_the_points_file_says_so() -> None:
    assert behind("/G1 X1\n /what ever", CamSettings(skips=True)) == []


def test_a_per_cent_sign_begins_and_ends_a_file() -> None:
    assert lines("\n(head)\n%\nO1001 (name)\nG0 X1\n%\nnonsense") == ["5: ML X=1 F=100"]


# What is refused


@pytest.mark.parametrize(
    ("block", "mistake"),
    [
        ("G5 X1", "2:1: `G5`, allowed G0, G1, G2, G3: let the CAM system write lines and arcs"),
        ("X1 G28 Z0", "2:4: `G28`, allowed no reference point: HOME, or MJ to a point, in the calling program"),
        ("G41 D1", "2:1: `G41`, allowed the path of the tool's tip: let the CAM system compensate the radius"),
        ("G81 X1 Z-5 R2", "2:1: `G81`, allowed single moves: let the CAM system write no cycles"),
        ("G93", "2:1: `G93`, allowed G94: mm or inches per minute"),
        ("G55", "2:1: `G55`, allowed G54; the frame is that of the calling program: Z=name"),
        ("G1 G2 X1", "2:4: `G2`, allowed one of them in a block, not G1 too"),
        ("M3 M5", "2:4: `M5`, allowed one of them in a block, not M3 too"),
        ("X1 X2", "2:4: `X2`, allowed X once in a block"),
        ("X1 U2", "2:4: `U2`, allowed words with A B C, F G I J K M N P R S T, X Y Z"),
        ("H1", "2:1: `H1`, allowed H with G43"),
        ("I1", "2:1: `I1`, allowed I, J, K and R with G2 and G3"),
        ("G1 X#1", "2:4: `X#1`, allowed letters with their numbers, as in X12.5; comments in ( ) or after ;"),
        ("#1=5", "2:1: `#1=5`, allowed numbers: let the CAM system write no variables and no expressions"),
        ("X1 (no end", "2:4: `(no end`, allowed a comment that ends in its line: (text), none inside another"),
        ("X1e5", "2:3: `e5`, allowed words with A B C, F G I J K M N P R S T, X Y Z"),
        ("X99999999999", "2:1: `X99999999999`, allowed a number up to 1e+09"),
        ("F0", "2:1: `F0`, allowed a feed above 0 per minute"),
        ("G4 P500", "2:4: `P500`, allowed G4 P with 0 to 60 seconds, not milliseconds"),
        ("G4", "2:1: `G4`, allowed G4 P with 0 to 60 seconds, not milliseconds"),
        ("G64 P-1", "2:5: `P-1`, allowed a tolerance of 0 or more"),
        ("T1", "2:1: `T1` without M6, allowed M6, which changes the tool; or no T"),
        ("M6", "2:1: `M6`, allowed T and the number of the tool, then M6"),
        ("M7", "2:1: `M7`, allowed M0, M1, M3, M4, M5, M8, M9, S, T1, T2; or under cam in the points file what M7 "
               "means: statements, or [] for nothing"),
        ("G1 A5 X1", "2:4: `A5` alone, allowed A, B and C in the first block that turns the tool: its orientation, as "
                     "in ML"),
        ("G80 X1", "2:5: `X1` without a motion, allowed G0, G1, G2 or G3 before it"),
        ("G2 X10", "2:4: G2 without its centre, allowed I and J of its centre, or R"),
        ("G2 X10 K5", "2:8: `K5`, allowed I and J in this plane, or R alone"),
        ("G2 X10 R5 I5", "2:8: `R5`, allowed I, J, K or R, not both"),
        ("G2 X0 Y0 R5", "2:10: `R5` with the end at the start, allowed I, J, K for a whole circle"),
        ("G3 X10 R4.9", "2:8: `R4.9` over a way of 10 mm, allowed a radius of 5 mm or more"),
        ("G2 X10 I0", "2:4: an arc whose centre is its start, allowed the offset of the centre from the start"),
        ("G2 X10 Y0 I4", "2:4: an arc that begins 4.0000 mm from its centre and ends 6.0000 mm from it, allowed the "
                         "same radius to 0.005 mm or 0.1%: look at I, J, K, G90.1 and the unit"),
        ("A0B0C0\nG3 I5 A0 B0 C9", "3:4: A B C on a helix, or an arc of more than 270 degrees, allowed shorter arcs "
                                   "without a climb, or the orientation before it"),
    ],
)  # fmt: skip
def test_what_is_not_understood_is_refused_by_its_line(block: str, mistake: str) -> None:
    assert mistakes(AT + block) == [mistake]


def test_an_increment_needs_a_place_and_a_cut_needs_a_feed_which_is_told_once() -> None:
    assert mistakes("G91 G0 X5") == ["1:8: `X5` in G91 from a place that the file has not said, allowed X in G90 first"]
    assert mistakes("G1 X1\nG1 X2") == ["1:4: G1 without a feed, allowed F before it, in mm or inches per minute"]


def test_a_code_may_not_steer_the_program() -> None:
    cam = CamSettings(codes={"M7": ("ML X=1",), "M8": ("",)})
    allowed = "one statement out of SET, RESET, WAIT, M, MEET, T, ATTACH, DETACH, CALL"
    assert mistakes("M7\nM8", cam) == [
        f"1:1: `ML X=1`, which cam says for M7, allowed {allowed}",
        f"2:1: ``, which cam says for M8, allowed {allowed}",
    ]  # fmt: skip


def test_all_mistakes_are_told_at_once_with_file_and_line(tmp_path: Path) -> None:
    (tmp_path / "bad.nc").write_text("G21\nG99.9\nM3 S1\nG1 X5 F1\n")
    names = Names(("J1",), cam=CAM, outputs=("laser",))
    with pytest.raises(ProgramError) as caught:
        parse_program("ML X=0 F=1\nCALL bad.nc\nML X=0 W=1", "main", names, tmp_path)
    told = [f"{each.file or 'main'}:{each}".split(", allowed")[0] for each in caught.value.problems]
    assert told == [
        "main:3:8: found `W=1`", "bad.nc:2:1: found `G99.9`", "bad.nc:3:1: found unknown output `spindle`",
        "bad.nc:4:4: found F=0.0166667",
    ]  # fmt: skip


def test_the_page_names_every_code_and_its_points_file_is_one(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "gcode.md").read_text()
    assert [f"G{code / 10:g}" for code in _GROUPS if not re.search(rf"\bG{code / 10:g}\b", page)] == []
    (file := tmp_path / "points.yaml").write_text(page.split("```yaml\n")[1].split("```")[0])
    assert load_points(file, PointsOwner(("J1",))).cam.codes["T2"] == ("CALL fetch_engraver.prog",)


# Within programs


def test_a_called_file_runs_in_the_frame_of_its_caller_and_is_told_by_its_own_lines(tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_text("(head)\nG0 X1 Y2 Z3\nM30\n")
    text = "ML X=0 Y=0 Z=0 F=5\nZ=plate\nCALL part.nc 2\nEND"
    program = parse_program(text, "main", Names(("J1",), cam=CAM), tmp_path)
    steps = steps_of(program)
    assert [program.place_of(step.line) for step in steps] == [("main", 1), ("part.nc", 2), ("part.nc", 2)]
    assert isinstance(steps[1], LineStep)
    assert (steps[1].aim.frame, steps[1].orientation_abc) == ("plate", None)
    assert program.text_of(steps[1].line) == "G0 X1 Y2 Z3"


def test_memory_grows_by_line_and_is_that_of_the_same_in_the_own_language() -> None:
    def peak_kb(text: str, name: str) -> float:
        tracemalloc.start()
        parse_program(text, name, Names(("J1",), cam=CAM))
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak / 1024.0

    def cam(count: int) -> str:
        return AT + "\n".join(f"G1 X{i / 7:.3f} Y{math.sin(i):.3f}" for i in range(count))

    few, many = cam(50), cam(250)
    assert peak_kb(many, "p.nc") < 7.0 * peak_kb(few, "p.nc")
    own = "\n".join(each.split(": ")[1] for each in lines(many))
    assert peak_kb(many, "p.nc") < 1.2 * peak_kb(own, "p")
