"""G-code of CAM systems to statements of the robot language: `CALL part.nc` runs what `cell import part.nc` writes.

The dialect is RS274/NGC (Kramer, Proctor, Messina: The NIST RS274NGC Interpreter, Version 3, NISTIR 6556, 2000), as far
as a robot has what it speaks of. `docs/gcode.md` is its reference for people.
"""

import math
import re
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import PurePath
from typing import NamedTuple

from cell.config.points_file import ENDED_BY, CamSettings
from cell.config.yaml_edit import number_text
from robot_agent.language.words import Mistake, statements_in

SUFFIXES = (".nc", ".ngc", ".cnc", ".tap", ".gcode")
_INCH_MM = 25.4
_TOKEN = re.compile(r"\s*(?:([A-Za-z])[ \t]*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+))|(\([^()]*\))|(;.*)|(\S.*))", re.DOTALL)
_MOST = 1e9
"""Larger numbers are mistakes in typing."""
_DIGITS = 9
"""After the point, of mm: rounding is a picometre."""
_SAME_PLACE_MM = 1e-6
_FLAT_MM, _FLAT_RAD = 1e-6, 4e-6
"""An arc that stays so near to its chord, or turns so little, is a line."""
_WIDEST_RAD = math.radians(270.0)
"""Beyond it start and end are too near to each other to give the circle with a point between them; so are three
points of a short arc that climbs. Such arcs are given by two far points and their angle."""
_ALWAYS_ROUND_MM, _NEVER_ROUND_MM, _ROUND = 0.005, 0.5, 1e-3
"""How far start and end may differ in their distance from the centre, and as a share of it (as LinuxCNC)."""
_MOST_DWELL_S = 60.0
_NEVER = -1

_GROUPS = {
    0: "motion", 10: "motion", 20: "motion", 30: "motion", 40: "dwell", 170: "plane", 180: "plane", 190: "plane",
    200: "unit", 210: "unit", 400: "radius", 430: "length", 490: "length", 540: "offset", 610: "path", 611: "path",
    640: "path", 800: "cycle", 900: "distance", 910: "distance", 901: "centre", 911: "centre", 940: "feed",
    980: "return", 990: "return",
}  # fmt: skip
"""Of each code, ten times its number, a name that at most one of a block has. Those that are not asked for below say
what is always so here: no cutter radius, the tool's tip, the calling program's frame, no cycle, feed per minute."""
_PLANES = {170: (0, 1, 2), 180: (2, 0, 1), 190: (1, 2, 0)}
"""The axes in which arcs turn, counter-clockwise from the first to the second as seen from the third."""
_FRAME = "G54; the frame is that of the calling program: Z=name"
_INSTEAD = {
    **dict.fromkeys((100, 520, 530, 550, 560, 570, 580, 590, 591, 592, 593, 920, 921, 922, 923), _FRAME),
    **dict.fromkeys((280, 281, 300, 301), "no reference point: HOME, or MJ to a point, in the calling program"),
    **dict.fromkeys((410, 411, 420, 421), "the path of the tool's tip: let the CAM system compensate the radius"),
    **dict.fromkeys((730, *range(810, 900, 10)), "single moves: let the CAM system write no cycles"),
    **dict.fromkeys((930, 950), "G94: mm or inches per minute"),
    **dict.fromkeys((50, 51, 52), "G0, G1, G2, G3: let the CAM system write lines and arcs"),
}
"""What is allowed instead of codes that people meet."""
_M_GROUPS = {3: "spindle", 4: "spindle", 5: "spindle", 0: "stop", 1: "stop", 2: "stop", 30: "stop"}
_PAUSES = {"M0": ("M 0",), "M1": ("M 1",)}
_STATEMENTS = ("SET", "RESET", "WAIT", "M", "MEET", "T=", "ATTACH", "DETACH", "CALL")
"""That may take the place of a code."""
_MOVING = ("T=", "CALL", "ATTACH", "DETACH")
"""After which nobody knows whether the TCP is where the file has led it."""


def is_cam(name: str) -> bool:
    """Whether a file of this name is read as G-code."""
    return PurePath(name).suffix.lower() in SUFFIXES


def statements_of(
    text: str, cam: CamSettings | None, wrong: Callable[[int, Mistake], None]
) -> Iterator[tuple[int, int, str]]:
    """What the blocks of a file come down to: line and column, from 1, and one statement of the robot language.

    Every mistake goes to `wrong` with its line; with one, what comes out is not the program. Where nobody can say what
    `cam` is, codes that it would have to know pass without statements.
    """
    machine = _Machine(cam)
    for line, written in enumerate(text.splitlines(), 1):
        if written.strip() == "%":
            if machine.begun:
                break
            continue
        if cam is not None and cam.skips and written.lstrip().startswith("/"):
            continue
        machine.line = line
        for column, statement in machine.run(_Block(written)):
            yield line, column, statement
        for mistake in machine.mistakes:
            wrong(line, mistake)
        machine.mistakes.clear()
        if machine.ended:
            break
    if machine.tool is not None and not machine.changed:
        line, word = machine.tool
        wrong(line, Mistake(word.column, f"`{word.text}` without M6", "M6, which changes the tool; or no T"))


class _Word(NamedTuple):
    """A letter with its number."""

    letter: str
    value: float
    column: int
    text: str

    @property
    def code(self) -> str:
        """As `M3`, of `m03`."""
        return f"{self.letter}{self.value:g}"


class _Block:
    """The words of one line."""

    def __init__(self, written: str) -> None:
        self.mistakes: list[Mistake] = []
        self.words: dict[str, _Word] = {}
        """Those but G and M by letter; who has understood one takes it out."""
        self.g: dict[str, _Word] = {}
        """By group."""
        self.m: list[_Word] = []
        self.alone = False
        """Its coordinates belong to a G that is refused."""
        begin = len(written) - len(written.lstrip())
        for match in _TOKEN.finditer(written, begin + (written[begin : begin + 1] == "/")):
            letter, number, _, _, unknown = match.groups()
            if letter is not None:
                column = match.start(1) + 1
                self._take(_Word(letter.upper(), float(number), column, written[column - 1 : match.end()]))
            elif unknown is not None:
                self.mistakes.append(_unreadable(match.start(5) + 1, unknown))
        number = self.words.pop("N", None)
        if len(self.words) == 1 and not self.g and not self.m:
            self.words.pop("O", None)  # the number of the program

    def _take(self, word: _Word) -> None:
        if abs(word.value) > _MOST:
            self._wrong(word, f"a number up to {_MOST:g}")
        elif word.letter == "G":
            code = round(10.0 * word.value)
            if code not in _GROUPS or abs(10.0 * word.value - code) > 1e-6:
                self.alone = True
                self._wrong(word, _INSTEAD.get(code, f"one of {_CODES}"))
            elif (group := _GROUPS[code]) in self.g:
                self._wrong(word, f"one of them in a block, not {self.g[group].text} too")
            else:
                self.g[group] = word._replace(value=code)
        elif word.letter == "M":
            before = next((each for each in self.m if _m_group(each) == _m_group(word)), None)
            if before is None:
                self.m.append(word)
            else:
                self._wrong(word, f"one of them in a block, not {before.text} too")
        elif word.letter in self.words:
            self._wrong(word, f"{word.letter} once in a block")
        else:
            self.words[word.letter] = word

    def _wrong(self, word: _Word, allowed: str) -> None:
        self.mistakes.append(Mistake(word.column, f"`{word.text}`", allowed))


_CODES = ", ".join(f"G{code / 10:g}" for code in _GROUPS)


def _m_group(word: _Word) -> object:
    return _M_GROUPS.get(int(word.value), word.value)


def _unreadable(column: int, text: str) -> Mistake:
    shown = text if len(text) <= 20 else f"{text[:20]}..."
    if text.startswith("("):
        return Mistake(column, f"`{shown}`", "a comment that ends in its line: (text), none inside another")
    if text.startswith(("#", "[")):
        return Mistake(column, f"`{shown}`", "numbers: let the CAM system write no variables and no expressions")
    return Mistake(column, f"`{shown}`", "letters with their numbers, as in X12.5; comments in ( ) or after ;")


class _Machine:
    """What holds from block to block; lengths in mm."""

    def __init__(self, cam: CamSettings | None) -> None:
        self.mistakes: list[Mistake] = []
        self.begun = self.ended = self.changed = False
        self.line = 0
        self.tool: tuple[int, _Word] | None = None
        """The newest T and its line."""
        self._cam = cam or CamSettings()
        self._codes = None if cam is None else {**_PAUSES, **cam.codes}
        self._unit_mm, self._relative, self._absolute_centre = 1.0, False, False
        self._motion, self._plane = _NEVER, _PLANES[170]
        self._feed_mm_s: float | None = None
        self._feed_deg_s = 0.0
        self._place: list[float | None] = [None, None, None]
        self._angles: list[float | None] = [None, None, None]
        self._here = False
        """Whether the TCP is at `_place` and turned by `_angles`."""
        self._said_f: float | None = None
        self._said_tol: float | None = None
        self._to_end: set[str] = set()
        """Codes that the end of the program does, because what they end is on."""

    def run(self, block: _Block) -> Iterator[tuple[int, str]]:
        """Column and text of each statement that a block comes down to, in the order of NISTIR 6556, 3.8.

        Only the unit and the distance mode hold for the whole block, F in front of them too.
        """
        self.begun = self.begun or bool(block.words or block.g or block.m or block.mistakes)
        self.mistakes += block.mistakes
        if block.alone:
            block.words = {letter: word for letter, word in block.words.items() if letter in "FST"}
        self._set(block)
        for step in (self._before, self._dwell, self._path, self._move, self._after):
            try:
                yield from step(block)
            except Mistake as mistake:
                self.mistakes.append(mistake)
        for word in block.words.values():
            self.mistakes.append(Mistake(word.column, f"`{word.text}`", _use_of(word.letter)))

    def _set(self, block: _Block) -> None:
        """What only says how the words after it are meant."""
        if (word := block.g.get("unit")) is not None:
            self._unit_mm = _INCH_MM if word.value == 200 else 1.0
        if (word := block.g.get("distance")) is not None:
            self._relative = word.value == 910
        if (word := block.g.get("centre")) is not None:
            self._absolute_centre = word.value == 901
        if (word := block.g.get("plane")) is not None:
            self._plane = _PLANES[int(word.value)]
        if (word := block.g.get("motion")) is not None:
            self._motion = int(word.value)
        elif "cycle" in block.g:
            self._motion = _NEVER
        if (word := block.g.get("length")) is not None and word.value == 430:
            block.words.pop("H", None)

    def _before(self, block: _Block) -> Iterator[tuple[int, str]]:
        """Feed, speed, tool, and the M of a block but those that stop."""
        if (word := block.words.pop("F", None)) is not None:
            if word.value <= 0.0:
                self._wrong(word, "a feed above 0 per minute")
            self._feed_mm_s, self._feed_deg_s = word.value * self._unit_mm / 60.0, word.value / 60.0
        if (word := block.words.pop("T", None)) is not None:
            self.tool = self.line, word
        if (word := block.words.pop("S", None)) is not None:
            yield from self._code("S", word)
        for word in block.m:
            if word.value == 6:
                self.changed = True
                if self.tool is not None:
                    yield from self._code(self.tool[1].code, word)
                else:
                    self._wrong(word, "T and the number of the tool, then M6")
            elif _m_group(word) != "stop":
                yield from self._code(word.code, word)

    def _code(self, code: str, word: _Word) -> Iterator[tuple[int, str]]:
        """The statements that take the place of a code."""
        if self._codes is None:
            return
        if code not in self._codes:
            there = ", ".join(sorted(self._codes))
            allowed = f"{there}; or under cam in the points file what {code} means: statements, or [] for nothing"
            found = f"`{word.text}`" if code[0] == word.letter else f"`{word.text}` with {code}"
            self.mistakes.append(Mistake(word.column, found, allowed))
            return
        if code in ENDED_BY:
            self._to_end.add(ENDED_BY[code])
        self._to_end.discard(code)
        for text in self._codes[code]:
            said = statements_in(text)
            head = said[0][0].statement if len(said) == 1 else ""
            if head not in _STATEMENTS:
                names = ", ".join(each.rstrip("=") for each in _STATEMENTS)
                raise Mistake(word.column, f"`{text}`, which cam says for {code}", f"one statement out of {names}")
            if head in _MOVING:
                self._here, self._said_f, self._said_tol = False, None, None
            yield word.column, text

    def _wrong(self, word: _Word, allowed: str) -> None:
        self.mistakes.append(Mistake(word.column, f"`{word.text}`", allowed))

    def _dwell(self, block: _Block) -> Iterator[tuple[int, str]]:
        if (word := block.g.get("dwell")) is None:
            return
        seconds = block.words.pop("P", None)
        if seconds is None or not 0.0 <= seconds.value <= _MOST_DWELL_S:
            at = seconds or word
            raise Mistake(at.column, f"`{at.text}`", f"G4 P with 0 to {_MOST_DWELL_S:g} seconds, not milliseconds")
        yield word.column, f"WAIT {_text(seconds.value)}"

    def _path(self, block: _Block) -> Iterator[tuple[int, str]]:
        """`TOL`: how near to its corners the path keeps."""
        if (word := block.g.get("path")) is None:
            return
        tolerance_mm = 0.0
        if word.value == 640:
            said = block.words.pop("P", None)
            block.words.pop("Q", None)  # of lines that are taken together, which stay within P here
            tolerance_mm = self._cam.tolerance_mm if said is None else said.value * self._unit_mm
            if said is not None and said.value < 0.0:
                raise Mistake(said.column, f"`{said.text}`", "a tolerance of 0 or more")
        if tolerance_mm != self._said_tol:
            self._said_tol = tolerance_mm
            yield word.column, f"TOL {_text(tolerance_mm)}"

    def _after(self, block: _Block) -> Iterator[tuple[int, str]]:
        """What stops: a pause, or the end of the program with what it switches off."""
        for word in block.m:
            if word.value in (2, 30):
                self.ended = True
                yield from chain.from_iterable(self._code(code, word) for code in sorted(self._to_end))
            elif _m_group(word) == "stop":
                yield from self._code(word.code, word)

    def _move(self, block: _Block) -> Iterator[tuple[int, str]]:
        """A move, where the block has a place or the middle of an arc."""
        arc = self._motion in (20, 30)
        words = [block.words.pop(letter) for letter in "XYZABC" if letter in block.words]
        middle = {letter: block.words.pop(letter) for letter in "IJKR" if arc and letter in block.words}
        if not words and not middle:
            return
        first = min((*words, *middle.values()), key=lambda word: word.column)
        if self._motion == _NEVER:
            raise Mistake(first.column, f"`{first.text}` without a motion", "G0, G1, G2 or G3 before it")
        place, angles = self._target(words)
        here, self._here = self._here, None not in place
        before, self._place = self._place, place
        turned, self._angles = angles != self._angles, angles
        abc = _pairs("ABC", angles) if (turned or not here) and None not in angles else ""
        if here and place == before and not turned and not middle:
            return
        if not arc or (text := self._arc(first, middle, before if here else None, place, abc)) is None:
            only_turns = here and place == before and self._motion != 0
            text = f"ML{_pairs('XYZ', place)}{abc}" + (f" FA={_text(self._feed_deg_s)}" if only_turns else "")
        yield first.column, text + self._pace(first)

    def _target(self, words: list[_Word]) -> tuple[list[float | None], list[float | None]]:
        """Coordinates [mm] and angles [deg] where a block leads; None for those that no block has named yet."""
        place, angles = self._place.copy(), self._angles.copy()
        for word in words:
            linear = word.letter in "XYZ"
            values, at = (place, "XYZ".index(word.letter)) if linear else (angles, "ABC".index(word.letter))
            value, before = word.value * (self._unit_mm if linear else 1.0), values[at]
            if self._relative and before is None:
                found = f"`{word.text}` in G91 from a place that the file has not said"
                raise Mistake(word.column, found, f"{word.letter} in G90 first")
            values[at] = round(value + before if self._relative and before is not None else value, _DIGITS)
        if None in angles and (word_of := next((word for word in words if word.letter in "ABC"), None)) is not None:
            allowed = "A, B and C in the first block that turns the tool: its orientation, as in ML"
            raise Mistake(word_of.column, f"`{word_of.text}` alone", allowed)
        return place, angles

    def _pace(self, word: _Word) -> str:
        """F where it is another one than the robot moves at."""
        if self._motion != 0 and self._feed_mm_s is None:
            self._feed_mm_s = self._cam.rapid_mm_s  # told once
            found = f"G{self._motion // 10} without a feed"
            raise Mistake(word.column, found, "F before it, in mm or inches per minute")
        speed = self._cam.rapid_mm_s if self._motion == 0 or self._feed_mm_s is None else self._feed_mm_s
        if speed == self._said_f:
            return ""
        self._said_f = speed
        return f" F={_text(speed)}"

    def _arc(
        self,
        word: _Word,
        middle: dict[str, _Word],
        before: list[float | None] | None,
        place: list[float | None],
        abc: str,
    ) -> str | None:
        """MC from the place `before` to another one; None where that is as good as a line."""
        known, ends = ([value for value in each if value is not None] for each in (before or [], place))
        if len(known) < 3 or len(ends) < 3:
            found = f"G{self._motion // 10} from a place that the file has not said"
            raise Mistake(word.column, found, "G0 or G1 to X, Y and Z before it, after a change of the tool too")
        start, end = ([each[axis] for axis in self._plane] for each in (known, ends))
        circle = _Circle.of(self._centre(word, middle, start, end), start, end, 1.0 if self._motion == 30 else -1.0)
        circle.check(word)
        if circle.is_flat:
            return None
        lift = end[2] - start[2]
        by_angle = circle.sweep > _WIDEST_RAD or lift != 0.0
        if by_angle and abc:
            found = "A B C on a helix, or an arc of more than 270 degrees"
            raise Mistake(word.column, found, "shorter arcs without a climb, or the orientation before it")

        def at(turn: float, radius: float) -> list[float | None]:
            """A point of the circle, in X Y Z."""
            values: list[float | None] = [start[2]] * 3
            values[self._plane[0]], values[self._plane[1]] = circle.at(turn, radius)
            return values

        names = "QX", "QY", "QZ"
        if not by_angle:
            via = at(circle.sweep / 2.0, (circle.first + circle.last) / 2.0)
            return f"MC{_pairs(names, via)}{_pairs('XYZ', place)}{abc}"
        via, target = (at(share * math.tau / 3.0, circle.first) for share in (1.0, 2.0))
        climb = f" LIFT={_text(circle.sense * lift)}" if lift else ""
        return f"MC{_pairs(names, via)}{_pairs('XYZ', target)} H={_text(math.degrees(circle.sweep))}{climb}"

    def _centre(
        self, word: _Word, middle: dict[str, _Word], start: list[float], end: list[float]
    ) -> tuple[float, float]:
        """Of an arc, along the two axes of its plane."""
        names = ["IJK"[axis] for axis in self._plane[:2]]
        said = [letter for letter in middle if letter not in names]
        if said and said != ["R"]:
            other = middle[said[0]]
            raise Mistake(other.column, f"`{other.text}`", f"{names[0]} and {names[1]} in this plane, or R alone")
        if said:
            if len(middle) > 1:
                raise Mistake(middle["R"].column, f"`{middle['R'].text}`", "I, J, K or R, not both")
            return self._by_radius(middle["R"], start, end)
        if not middle or (self._absolute_centre and len(middle) < 2):
            allowed = f"{names[0]} and {names[1]} of its centre, or R"
            raise Mistake(word.column, f"G{self._motion // 10} without its centre", allowed)
        values = [middle[name].value * self._unit_mm if name in middle else 0.0 for name in names]
        offset = (0.0, 0.0) if self._absolute_centre else (start[0], start[1])
        return values[0] + offset[0], values[1] + offset[1]

    def _by_radius(self, word: _Word, start: list[float], end: list[float]) -> tuple[float, float]:
        """The centre of an arc with this radius; a negative one goes the longer way."""
        radius, x, y = word.value * self._unit_mm, end[0] - start[0], end[1] - start[1]
        half = math.hypot(x, y) / 2.0
        if half < _SAME_PLACE_MM:
            raise Mistake(word.column, f"`{word.text}` with the end at the start", "I, J, K for a whole circle")
        if half > abs(radius) + _ALWAYS_ROUND_MM:
            found = f"`{word.text}` over a way of {2.0 * half:g} mm"
            raise Mistake(word.column, found, f"a radius of {half:g} mm or more")
        side = math.copysign(1.0, radius) * (1.0 if self._motion == 30 else -1.0)
        away = side * math.sqrt(max(0.0, radius**2 - half**2)) / (2.0 * half)
        return (start[0] + end[0]) / 2.0 - away * y, (start[1] + end[1]) / 2.0 + away * x


class _Circle(NamedTuple):
    """An arc in its plane; lengths in mm, counter-clockwise where `sense` is 1, clockwise where it is -1."""

    centre: tuple[float, float]
    sense: float
    angle: float
    """Where it begins."""
    sweep: float
    """How far it goes, above 0 to a whole turn."""
    first: float
    last: float
    """Radius where it begins, and where it ends."""

    @classmethod
    def of(cls, centre: tuple[float, float], start: list[float], end: list[float], sense: float) -> "_Circle":
        a, b = start[0] - centre[0], start[1] - centre[1]
        c, d = end[0] - centre[0], end[1] - centre[1]
        turned = math.atan2(sense * (a * d - b * c), a * c + b * d) % math.tau
        sweep = math.tau if math.hypot(c - a, d - b) < _SAME_PLACE_MM else turned
        return cls(centre, sense, math.atan2(b, a), sweep, math.hypot(a, b), math.hypot(c, d))

    @property
    def is_flat(self) -> bool:
        """Whether it stays as near to its chord as a line."""
        sagitta = self.first * (1.0 - math.cos(min(self.sweep, math.pi) / 2.0))
        return self.sweep < _FLAT_RAD or sagitta < _FLAT_MM

    def at(self, turn: float, radius: float) -> tuple[float, float]:
        """The point at an angle from its beginning, so far from the centre."""
        angle = self.angle + self.sense * turn
        return self.centre[0] + radius * math.cos(angle), self.centre[1] + radius * math.sin(angle)

    def check(self, word: _Word) -> None:
        """Whether start and end are as far from the centre; or Mistake."""
        apart = abs(self.first - self.last)
        if self.first < _SAME_PLACE_MM:
            raise Mistake(word.column, "an arc whose centre is its start", "the offset of the centre from the start")
        if apart > _NEVER_ROUND_MM or (apart > _ALWAYS_ROUND_MM and apart > _ROUND * self.first):
            found = f"an arc that begins {self.first:.4f} mm from its centre and ends {self.last:.4f} mm from it"
            allowed = f"the same radius to {_ALWAYS_ROUND_MM:g} mm or {_ROUND:.1%}: look at I, J, K, G90.1 and the unit"
            raise Mistake(word.column, found, allowed)


def _use_of(letter: str) -> str:
    """Where a letter is allowed that was not understood in its block."""
    uses = {"P": "P with G4 or G64", "Q": "Q with G64", "H": "H with G43", "O": "O alone, as the program's number"}
    arcs = "I, J, K and R with G2 and G3"
    allowed = {**uses, **dict.fromkeys("IJKR", arcs)}.get(letter)
    return allowed or "words with A B C, F G I J K M N P R S T, X Y Z"


def _pairs(names: tuple[str, ...] | str, values: list[float | None]) -> str:
    """` X=1 Y=2`, without what is not known."""
    pairs = zip(names, values, strict=True)
    return "".join(f" {name}={_text(value)}" for name, value in pairs if value is not None)


def _text(value: float) -> str:
    return number_text(value, _DIGITS)
