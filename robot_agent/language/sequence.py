"""The statements between the moves: what is followed, switched and waited for, and where the program goes on."""

import re
from dataclasses import dataclass
from typing import Self

from robot_agent.language.statement import Reading, Statement, Walk, statement
from robot_agent.language.steps import Finished, Meet, ProgramFault, Switch, TrackingOff, TrackingOn
from robot_agent.language.words import Mistake, Word, number, signal_name

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
MAX_WAIT_S = 3600.0
_MAX_JUMPS = 1_000_000


@statement("TRACK")
@dataclass(frozen=True, slots=True)
class Track(Statement):
    """`TRACK name`, `TRACK OFF`: from here on the robot follows this correction on its path, or (`None`) none."""

    name: str | None

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        word = only_argument(words, "the name of a correction, or OFF")
        if word.text.upper() == "OFF":
            return cls(line, None)
        if reading.names.corrections is not None and word.text not in reading.names.corrections:
            known = ", ".join(sorted(reading.names.corrections)) or "this robot has none in the cell file"
            raise Mistake(word.column, f"unknown correction `{word.text}`", f"OFF or a name of corrections: {known}")
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
    """`SET DO name`, `RESET DO name`: where the move before it ends, this digital output is switched."""

    output: str
    on: bool

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        named = signal_name(words, 1, "DO")
        if named is None or named[1] != len(words):
            found = f"`{' '.join(word.text for word in words)}`"
            raise Mistake(words[0].column, found, f"{words[0].text.upper()} DO and the name of an output")
        word = named[0]
        if reading.names.outputs is not None and word.text not in reading.names.outputs:
            known = ", ".join(sorted(reading.names.outputs)) or "this robot has none in its drives file"
            raise Mistake(word.column, f"unknown output `{word.text}`", f"a name of outputs: {known}")
        return cls(line, word.text, words[0].text.upper() == "SET")

    def run(self, walk: Walk) -> Switch:
        walk.switched += 1
        return Switch(self.line, self.output, self.on, walk.switched)

    @property
    def switched_outputs(self) -> tuple[str, ...]:
        return (self.output,)


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
            known = ", ".join(sorted(reading.names.spaces)) or "this robot has none with by_program in the cell file"
            raise Mistake(word.column, f"unknown space `{word.text}`", f"a name of spaces with by_program: {known}")
        return cls(line, word.text, words[2].text.upper() == "ON")

    def run(self, walk: Walk) -> None:
        walk.spaces_off = walk.spaces_off - {self.space} if self.on else walk.spaces_off | {self.space}


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
            known = ", ".join(sorted(reading.names.meetings)) or "this robot is in none in the cell file"
            raise Mistake(word.column, f"unknown meeting `{word.text}`", f"a name of meetings: {known}")
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
    """`LABEL name`: a place to jump to."""

    name: str

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        word = only_argument(words, "a name")
        if not _NAME.match(word.text):
            raise Mistake(word.column, f"`{word.text}`", "a name of letters, digits and _, starting with a letter")
        if word.text in reading.labels:
            raise Mistake(word.column, f"label `{word.text}` a second time", "each label once")
        reading.labels[word.text] = reading.place + 1
        return cls(line, word.text)

    def run(self, _walk: Walk) -> None:
        pass


@statement("GOTO")
@dataclass(frozen=True, slots=True)
class Goto(Statement):
    """`GOTO name n`: jump `n` times, then go on; without `n` jump always. The count starts anew after it ran out."""

    target: int
    """Index of the statement after the label."""
    count: int | None

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        if len(words) not in (2, 3):
            raise Mistake(words[0].column, f"{len(words) - 1} words after GOTO", "a label and, if wanted, a count")
        count = None
        if len(words) == 3:
            value = number(words[2].text, words[2])
            if value != int(value) or not 1 <= value <= _MAX_JUMPS:
                raise Mistake(words[2].column, f"count {words[2].text}", f"a whole number, 1 to {_MAX_JUMPS}")
            count = int(value)
        reading.linked.append((reading.place, lambda: cls(line, place_of(words[1], reading.labels), count)))
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


@statement("END")
@dataclass(frozen=True, slots=True)
class End(Statement):
    """`END`: the program is done."""

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        if len(words) > 1:
            raise Mistake(words[1].column, f"`{words[1].text}` after END", "nothing")
        return cls(line)

    def run(self, _walk: Walk) -> Finished:
        return Finished(self.line)


def only_argument(words: list[Word], what: str) -> Word:
    """The one word after the first, which is `what`; or Mistake."""
    if len(words) != 2:
        raise Mistake(words[0].column, f"{len(words) - 1} words after {words[0].text.upper()}", what)
    return words[1]


def place_of(word: Word, labels: dict[str, int]) -> int:
    """Index of the statement after the label that a word names, or Mistake."""
    if word.text not in labels:
        allowed = f"a label of this program: {', '.join(sorted(labels)) or 'it has none'}"
        raise Mistake(word.column, f"unknown label `{word.text}`", allowed)
    return labels[word.text]
