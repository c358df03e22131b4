"""The statements between the moves: what is followed, switched and waited for, and where the program goes on."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

from robot_agent.language.statement import STATEMENTS, Reading, Statement, SubCall, Walk, statement
from robot_agent.language.steps import Before, Finished, Meet, ProgramFault, Switch, TrackingOff, TrackingOn
from robot_agent.language.words import FARTHEST_MM, Mistake, Word, number, percent, signal_name, unknown

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
MAX_WAIT_S = 3600.0
_MAX_JUMPS = 1_000_000
MOST_CALLS = 20
"""Subroutines within one another."""


@statement("TRACK", "TRK")
@dataclass(frozen=True, slots=True)
class Track(Statement):
    """`TRACK name`, `TRACK OFF`, `TRK`: from here on the path follows this correction, or (`None`) none."""

    name: str | None

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        word = only_argument(words, "the name of a correction, or OFF")
        if word.text.upper() in ("OFF", "0"):
            return cls(line, None)
        if word.text.isdecimal() and word.text.isascii():
            word = Word(f"trk{word.text}", word.column)
        if reading.names.corrections is not None and word.text not in reading.names.corrections:
            raise unknown(word, "correction", {"OFF", *reading.names.corrections}, "")
        return cls(line, word.text)

    def run(self, walk: Walk) -> TrackingOn | TrackingOff | None:
        """One step at a time: a correction that is on is ended before the next one begins."""
        if walk.tracking:
            walk.tracking = False
            walk.index -= self.name is not None
            return TrackingOff(self.line)
        if self.name is None:
            return None
        walk.tracking = True
        return TrackingOn(self.line, self.name)


@statement("SET", "RESET")
@dataclass(frozen=True, slots=True)
class SetOutput(Statement):
    """`SET DO name`, `RESET DO name`: where the move before it ends, or earlier, this digital output is switched."""

    output: str
    on: bool
    before: Before | None = None

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        named = signal_name(words, 1, "DO")
        if named is None:
            found = f"`{' '.join(word.text for word in words)}`"
            raise Mistake(words[0].column, found, f"{words[0].text.upper()} DO and the name of an output")
        word, before = named[0], _before(words[named[1] :])
        output = reading.names.output(word.text)
        if reading.names.outputs is not None and output not in reading.names.outputs:
            raise unknown(word, "output", reading.names.outputs, "none: this robot has none in its drives file")
        return cls(line, output, words[0].text.upper() == "SET", before)

    def run(self, walk: Walk) -> Switch:
        walk.switched += 1
        return Switch(self.line, self.output, self.on, walk.switched, self.before)

    @property
    def switched_outputs(self) -> tuple[str, ...]:
        return (self.output,)

    @property
    def idle(self) -> bool:
        return True


@statement("SPACE")
@dataclass(frozen=True, slots=True)
class SwitchSpace(Statement):
    """`SPACE name ON`, `SPACE name OFF`: from the next move on the robot keeps to this space, or does not."""

    space: str
    on: bool

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        if len(words) != 3 or words[2].text.upper() not in ("ON", "OFF"):
            found = f"`{' '.join(word.text for word in words)}`"
            raise Mistake(words[0].column, found, "SPACE, the name of a space, and ON or OFF")
        word = words[1]
        if reading.names.spaces is not None and word.text not in reading.names.spaces:
            raise unknown(word, "space", reading.names.spaces, "none: by_program is set for none in the cell file")
        return cls(line, word.text, words[2].text.upper() == "ON")

    def run(self, walk: Walk) -> None:
        walk.spaces_off = walk.spaces_off - {self.space} if self.on else walk.spaces_off | {self.space}

    @property
    def idle(self) -> bool:
        return True


@statement("MEET")
@dataclass(frozen=True, slots=True)
class MeetOthers(Statement):
    """`MEET name`, `MEET name TIMEOUT s`: wait until all robots of the meeting are there, and leave with them."""

    meeting: str
    timeout_s: float | None

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        if len(words) != 2 and not (len(words) == 4 and words[2].text.upper() == "TIMEOUT"):
            found = f"`{' '.join(word.text for word in words)}`"
            raise Mistake(words[0].column, found, "MEET and the name of a meeting; if wanted, TIMEOUT and seconds")
        word = words[1]
        if reading.names.meetings is not None and word.text not in reading.names.meetings:
            raise unknown(word, "meeting", reading.names.meetings, "none: this robot is in none in the cell file")
        timeout_s = None
        if len(words) == 4:
            timeout_s = number(words[3].text, words[3])
            if not 0 < timeout_s <= MAX_WAIT_S:
                raise Mistake(words[3].column, f"TIMEOUT {words[3].text}", f"more than 0, up to {MAX_WAIT_S:g} s")
        return cls(line, word.text, timeout_s)

    def run(self, walk: Walk) -> Meet | ProgramFault:
        if walk.tracking:
            return ProgramFault(self.line, "MEET while the robot follows a correction: TRACK OFF comes first")
        return Meet(self.line, self.meeting, self.timeout_s)


@statement("LABEL")
@dataclass(frozen=True, slots=True)
class Label(Statement):
    """`LABEL name`, `name:`: a place to jump to."""

    name: str

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        word = only_argument(words, "a name")
        if not _NAME.match(word.text):
            raise Mistake(word.column, f"`{word.text}`", "a name of letters, digits and _, starting with a letter")
        if word.text.upper() in STATEMENTS:
            raise Mistake(word.column, f"label `{word.text}`", "a name that is no word of the language")
        if word.text in reading.labels:
            raise Mistake(word.column, f"label `{word.text}` a second time", "each label once")
        reading.labels[word.text] = reading.place + 1
        return cls(line, word.text)

    def run(self, _walk: Walk) -> None:
        pass

    @property
    def idle(self) -> bool:
        return True


@statement("GOTO")
@dataclass(frozen=True, slots=True)
class Goto(Statement):
    """`GOTO name n`: jump `n` times, then go on; without `n` jump always. The count starts anew after it ran out."""

    target: int
    """Index of the statement after the label."""
    count: int | None

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        count = _count(words, "a label and, if wanted, a count")
        name = words[1]
        reading.linked.append((reading.place, lambda: cls(line, place_of(name, reading.labels), count)))
        return cls(line, 0, count)

    def run(self, walk: Walk) -> None:
        if self.count is None:
            walk.index = self.target
            return
        place = walk.index - 1
        left = walk.jumps_left.get(place, self.count)
        if left > 0:
            walk.jumps_left[place] = left - 1
            walk.index = self.target
        else:
            del walk.jumps_left[place]

    def leads_to(self, place: int) -> tuple[int, ...]:
        return (self.target,) if self.count is None else (self.target, place + 1)

    def moved(self, places: Sequence[int]) -> Self:
        return replace(self, target=places[self.target])

    @property
    def idle(self) -> bool:
        return True


@statement("SUB", "CALL")
@dataclass(frozen=True, slots=True)
class Sub(Statement):
    """`SUB name n`: the subroutine from this label to its END, `n` times or once; `CALL file n`: the same of a file."""

    target: int
    """Index of its first statement."""
    count: int
    file: str = ""
    """Of CALL."""

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        call = words[0].text.upper() == "CALL"
        count = _count(words, f"{'a file' if call else 'a label'} and, if wanted, how often") or 1
        name = words[1]
        if call:
            reading.files.append((line, name))
            # without the file there is no place, and the mistake is told where it is looked for
            reading.linked.append(
                (reading.place, lambda: cls(line, reading.begins.get(name.text, 0), count, name.text))
            )
        else:
            reading.linked.append((reading.place, lambda: cls(line, place_of(name, reading.labels), count)))
        return cls(line, 0, count)

    def run(self, walk: Walk) -> "ProgramFault | None":
        if len(walk.calls) == MOST_CALLS:
            return ProgramFault(self.line, f"more than {MOST_CALLS} subroutines within one another")
        walk.calls.append(SubCall(self.target, walk.index, self.count - 1, walk.jumps_left))
        walk.index, walk.jumps_left = self.target, {}
        return None

    def leads_to(self, place: int) -> tuple[int, ...]:
        return (self.target, place + 1)

    def moved(self, places: Sequence[int]) -> Self:
        return replace(self, target=places[self.target])

    @property
    def idle(self) -> bool:
        return True


@statement("END")
@dataclass(frozen=True, slots=True)
class End(Statement):
    """`END`: the program is done; in a subroutine or a called file that is done, and what called it goes on."""

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        if len(words) > 1:
            raise Mistake(words[1].column, f"`{words[1].text}` after END", "nothing")
        return cls(line)

    def run(self, walk: Walk) -> Finished | None:
        if not walk.calls:
            return Finished(self.line)
        call = walk.calls[-1]
        walk.jumps_left = {}
        if call.left > 0:
            call.left -= 1
            walk.index = call.target
        else:
            walk.calls.pop()
            walk.index, walk.jumps_left = call.back, call.jumps_left
        return None

    def leads_to(self, _place: int) -> tuple[int, ...]:
        return ()


@statement("SPEED")
@dataclass(frozen=True, slots=True)
class Speed(Statement):
    """`SPEED n`: from here on moves run at this share of their F."""

    share: float

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        word = only_argument(words, "percent of the speed that each move is given")
        return cls(line, percent((number(word.text, word), word), words[0]))

    def run(self, walk: Walk) -> None:
        walk.speed_share = self.share

    @property
    def idle(self) -> bool:
        return True


def _before(words: list[Word]) -> Before | None:
    """Of the words after the output; None where there are none."""
    if not words:
        return None
    allowed = "nothing, or how far in front of the end of the move: BEFORE 50 MM, BEFORE 0.2 S"
    if len(words) != 3 or words[0].text.upper() != "BEFORE" or words[2].text.upper() not in ("MM", "S"):
        raise Mistake(words[0].column, f"`{' '.join(word.text for word in words)}`", allowed)
    value, unit = number(words[1].text, words[1]), words[2].text.upper()
    most = FARTHEST_MM if unit == "MM" else MAX_WAIT_S
    if not 0 < value <= most:
        raise Mistake(words[1].column, f"BEFORE {words[1].text}", f"more than 0, up to {most:g} {unit}")
    return Before(way_m=value / 1000.0) if unit == "MM" else Before(time_s=value)


def only_argument(words: list[Word], what: str) -> Word:
    """The one word after the first, which is `what`; or Mistake."""
    if len(words) != 2:
        raise Mistake(words[0].column, f"{len(words) - 1} words after {words[0].text.upper()}", what)
    return words[1]


def _count(words: list[Word], allowed: str) -> int | None:
    """The whole number after head and name; None where there is none."""
    if len(words) not in (2, 3):
        raise Mistake(words[0].column, f"{len(words) - 1} words after {words[0].text.upper()}", allowed)
    if len(words) == 2:
        return None
    value = number(words[2].text, words[2])
    if value != int(value) or not 1 <= value <= _MAX_JUMPS:
        raise Mistake(words[2].column, f"count {words[2].text}", f"a whole number, 1 to {_MAX_JUMPS}")
    return int(value)


def place_of(word: Word, labels: dict[str, int]) -> int:
    """Index of the statement after the label that a word names, or Mistake."""
    if word.text not in labels:
        raise unknown(word, "label", labels, "no label: this file has none")
    return labels[word.text]
