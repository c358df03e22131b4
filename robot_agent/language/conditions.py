"""The statements that ask and count: inputs that are waited for, branches, variables, and flags for the application.

What a condition says of numbers and variables is decided where the program is read in order, ahead of the motion: it
is the same there. What it asks of inputs and outputs is decided where the robot is, at rest, or ahead with LOOKAHEAD 1.
"""

import operator
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Self

from robot_agent.language.sequence import MAX_WAIT_S, only_argument, place_of
from robot_agent.language.statement import Reading, Statement, Walk, statement
from robot_agent.language.steps import (
    COMPARISONS,
    AwaitAnswer,
    AwaitInput,
    Decide,
    FlagMark,
    LetMark,
    Pause,
    ProgramFault,
    Question,
    Relation,
    Signal,
    Test,
    compare,
)
from robot_agent.language.words import Mistake, Word, number, signal_name, unknown

_COMPARED = re.compile(r"<>|<=|>=|[<>=]|[^\s<>=]+")
_COUNTED = re.compile(r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[A-Za-z_]\w*|[^\s]")
_VARIABLE = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
_ONE_WORD = re.compile(r"(D[IO])\d+\Z", re.IGNORECASE)
_RESERVED = {"DI", "DO", "NOT", "AND", "OR", "ON", "OFF"}
_CONDITION = "DI name, DO name, NOT DI name, or a comparison as in `n < 3`; several joined by AND, or by OR"
_SUM = "LET name = a, or a + b, a - b, a * b, a / b, with numbers and variables"
MOST_VARIABLES = 100
LARGEST = 1e12
"""Of what a variable may be, both ways."""
HIGHEST_FLAG = 999
_MOST_ROUNDS = 16

Value = float | str
"""A number, or the name of a variable."""

_SUMS: Mapping[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}


@dataclass(frozen=True, slots=True)
class Comparison:
    """Of two numbers or variables; numbers that differ by less than 1e-9 are equal."""

    left: Value
    sign: str
    right: Value
    foreign: frozenset[str] = frozenset()
    """Those of its variables that other robots set."""

    def resolved(self, variables: Mapping[str, float]) -> bool | Relation:
        """Whether it holds, or what is left of it to ask; all variables of the program are set."""
        left, right = (each if each in self.foreign else _number(each, variables) for each in (self.left, self.right))
        if isinstance(left, str) or isinstance(right, str):
            return Relation(left, self.sign, right)
        return compare(left, self.sign, right)


@dataclass(frozen=True, slots=True)
class Asked:
    """An input or output is on, or off."""

    signal: Signal
    on: bool


@dataclass(frozen=True, slots=True)
class Condition:
    """Of an IF: its terms all hold, or with `any_of` one of them does."""

    terms: tuple[Comparison | Asked, ...]
    any_of: bool

    def test(self, variables: Mapping[str, float]) -> Test:
        """What is left of it to ask, once all variables are set."""
        resolved = [term.resolved(variables) for term in self.terms if isinstance(term, Comparison)]
        asked: list[tuple[Question, bool]] = [(t.signal, t.on) for t in self.terms if isinstance(t, Asked)]
        asked += [(each, True) for each in resolved if isinstance(each, Relation)]
        return Test(tuple(asked), tuple(each for each in resolved if isinstance(each, bool)), self.any_of)

    @property
    def variables(self) -> tuple[str, ...]:
        """Those of the program that it needs."""
        compared = [term for term in self.terms if isinstance(term, Comparison)]
        named = ((term, each) for term in compared for each in (term.left, term.right) if isinstance(each, str))
        return tuple(each for term, each in named if each not in term.foreign)

    @property
    def asks(self) -> bool:
        """Whether it needs what nobody knows where the program is read."""
        return any(isinstance(term, Asked) or term.foreign for term in self.terms)

    @property
    def signals(self) -> tuple[Signal, ...]:
        """That it asks for."""
        return tuple(term.signal for term in self.terms if isinstance(term, Asked))


@dataclass(slots=True)
class Branches:
    """An IF while its program is read: the indices at which its ELSE branch begins, and of its ENDIF."""

    otherwise: int | None = None
    end: int | None = None


@dataclass(slots=True)
class Ways:
    """For checks, where nobody knows what will be asked: each fork of a program goes the way that was gone less often.

    A fork is an IF, or a WAIT DI with GOTO; the first time its condition holds, the second time it does not.
    """

    _gone: dict[int, list[int]] = field(default_factory=dict)
    """By line: so often it held, and did not."""

    def choose(self, line: int) -> bool:
        """Whether the condition of the fork in this line holds this time."""
        gone = self._gone.setdefault(line, [0, 0])
        held = gone[0] <= gone[1]
        gone[0 if held else 1] += 1
        return held

    def rounds(self, statements: tuple[Statement, ...]) -> Iterator[int]:
        """Counts rounds through these statements until both ways of each fork were gone, at most `_MOST_ROUNDS`."""
        forks = [each.line for each in statements if each.forks]
        for number_of_round in range(1, _MOST_ROUNDS + 1):
            yield number_of_round
            if all(min(self._gone.get(line, (0, 0))) > 0 for line in forks):
                return


@statement("WAIT")
@dataclass(frozen=True, slots=True)
class AnyWait(Statement):
    """`WAIT s`, `WAIT DI name`: stand still for a time, or for an input."""

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Statement:
        for_input = len(words) > 1 and (words[1].text.upper() == "DI" or _ONE_WORD.match(words[1].text))
        return (WaitInput if for_input else Wait).read(line, words, reading)


@dataclass(frozen=True, slots=True)
class Wait(AnyWait):
    """`WAIT s`: stand still."""

    duration_s: float

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        word = only_argument(words, "a time in seconds")
        duration_s = number(word.text, word)
        if not 0 <= duration_s <= MAX_WAIT_S:
            raise Mistake(word.column, f"WAIT {word.text}", f"0 to {MAX_WAIT_S:g} s")
        return cls(line, duration_s)

    def run(self, _walk: Walk) -> Pause:
        return Pause(self.line, self.duration_s)


@dataclass(frozen=True, slots=True)
class WaitInput(AnyWait):
    """`WAIT DI name [ON|OFF] [TIMEOUT s [GOTO label]]`: stand still until this input is on, or off."""

    signal: Signal
    on: bool
    timeout_s: float | None
    """After so long the program ends, or goes on at `target`."""
    target: int | None = None
    """Index of the statement after the label."""

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        allowed = "WAIT DI and the name of an input; if wanted ON or OFF, TIMEOUT and seconds, GOTO and a label"
        named = signal_name(words, 1, "DI")
        if named is None:
            raise Mistake(words[1].column, f"`{words[1].text}`", allowed)
        name, at = named
        asked = _known(name, "DI", reading)
        rest = words[at:]
        on = True
        if rest and rest[0].text.upper() in ("ON", "OFF"):
            on, rest = rest[0].text.upper() == "ON", rest[1:]
        if not rest:
            return cls(line, asked, on, None)
        keywords = [word.text.upper() for word in rest[::2]]
        if keywords not in (["TIMEOUT"], ["TIMEOUT", "GOTO"]) or len(rest) % 2:
            raise Mistake(rest[0].column, f"`{' '.join(word.text for word in rest)}`", allowed)
        timeout_s = number(rest[1].text, rest[1])
        if not 0 < timeout_s <= MAX_WAIT_S:
            raise Mistake(rest[1].column, f"TIMEOUT {rest[1].text}", f"more than 0, up to {MAX_WAIT_S:g} s")
        if len(rest) == 4:
            label = rest[3]
            reading.linked.append(
                (reading.place, lambda: cls(line, asked, on, timeout_s, place_of(label, reading.labels)))
            )
        return cls(line, asked, on, timeout_s)

    def run(self, walk: Walk) -> AwaitInput:
        if walk.ways is not None and self.target is not None and not walk.ways.choose(self.line):
            walk.index = self.target
        return AwaitInput(self.line, self.signal, self.on, self.timeout_s, self.target)

    def leads_to(self, place: int) -> tuple[int, ...]:
        return (place + 1,) if self.target is None else (place + 1, self.target)

    def moved(self, places: Sequence[int]) -> Self:
        return self if self.target is None else replace(self, target=places[self.target])

    @property
    def signals(self) -> tuple[Signal, ...]:
        return (self.signal,)

    @property
    def forks(self) -> bool:
        return self.target is not None


@statement("IF")
@dataclass(frozen=True, slots=True)
class If(Statement):
    """`IF condition`: go on with the next statement, or if the condition does not hold after ELSE or at ENDIF."""

    condition: Condition
    target: int = 0
    """Index of the statement with which the other branch begins."""

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        branches = Branches()
        reading.ifs.append(branches)
        condition = _condition(words, reading)

        def link() -> Statement:
            _check_set(words, condition.variables, reading)
            if branches.end is None:
                raise Mistake(words[0].column, "IF without ENDIF", "ENDIF after the last statement of its branches")
            return cls(line, condition, branches.end if branches.otherwise is None else branches.otherwise)

        reading.linked.append((reading.place, link))
        return cls(line, condition)

    def run(self, walk: Walk) -> Decide | ProgramFault | None:
        if walk.ways is not None:
            if not walk.ways.choose(self.line):
                walk.index = self.target
            return None if walk.ahead or not self.condition.asks else Decide(self.line, Test(), self.target)
        if fault := _unset(self.line, self.condition.variables, walk):
            return fault
        test = self.condition.test(walk.variables)
        holds = test.holds(walk.known if walk.ahead else lambda _: None)
        if holds is None:
            return Decide(self.line, test, self.target)
        if not holds:
            walk.index = self.target
        return None

    def leads_to(self, place: int) -> tuple[int, ...]:
        return (place + 1, self.target)

    def moved(self, places: Sequence[int]) -> Self:
        return replace(self, target=places[self.target])

    @property
    def signals(self) -> tuple[Signal, ...]:
        return self.condition.signals

    @property
    def forks(self) -> bool:
        return True


@statement("ELSE")
@dataclass(frozen=True, slots=True)
class Else(Statement):
    """`ELSE`: here begins what is done where the condition of the IF does not hold."""

    target: int = 0
    """Index of the statement at ENDIF, for who comes from the branch before it."""

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        branches = _innermost(words, reading)
        if branches.otherwise is not None:
            raise Mistake(words[0].column, "a second ELSE of one IF", "ENDIF")
        branches.otherwise = reading.place + 1
        _alone(words)
        reading.linked.append((reading.place, lambda: cls(line, branches.end or 0)))
        return cls(line)

    def run(self, walk: Walk) -> None:
        walk.index = self.target

    def leads_to(self, _place: int) -> tuple[int, ...]:
        return (self.target,)

    def moved(self, places: Sequence[int]) -> Self:
        return replace(self, target=places[self.target])

    @property
    def idle(self) -> bool:
        return True


@statement("ENDIF")
@dataclass(frozen=True, slots=True)
class EndIf(Statement):
    """`ENDIF`: here the branches of an IF join."""

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        _innermost(words, reading).end = reading.place
        reading.ifs.pop()
        _alone(words)
        return cls(line)

    def run(self, _walk: Walk) -> None:
        pass

    @property
    def idle(self) -> bool:
        return True


@statement("LET")
@dataclass(frozen=True, slots=True)
class Let(Statement):
    """`LET name = a`, `LET name = a + b`: the value of a variable from here on."""

    name: str
    first: Value
    sign: str = ""
    """Of + - * /; empty without a second value."""
    second: Value = 0.0
    shared: bool = False
    """It is a variable of the cell."""

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        tokens = _tokens(words[1:], _COUNTED)
        if len(tokens) < 3 or tokens[1].text != "=":
            raise Mistake(words[0].column, f"`{' '.join(word.text for word in words)}`", _SUM)
        name = _variable(tokens[0])
        if reading.names.sets(name) is False:
            sets = f"robot {reading.names.variables[name]}, by variables of the cell file"
            raise Mistake(tokens[0].column, f"LET {name}, which is set by {sets}", "a variable of this robot")
        shared = name in reading.names.variables
        first, rest = _operand(tokens[2:])
        made = cls(line, name, first, shared=shared)
        if rest:
            sign = rest[0]
            second, beyond = _operand(rest[1:]) if rest[1:] else (0.0, rest)
            if sign.text not in _SUMS or beyond:
                raise Mistake(sign.column, f"`{' '.join(token.text for token in rest)}`", _SUM)
            if sign.text == "/" and second == 0.0:
                raise Mistake(sign.column, "a division by 0", _SUM)
            made = cls(line, name, first, sign.text, second, shared)
        reading.variables.add(name)
        if len(reading.variables) > MOST_VARIABLES:
            raise Mistake(tokens[0].column, f"variable number {MOST_VARIABLES + 1}", f"{MOST_VARIABLES} in a program")
        reading.linked.append((reading.place, lambda: _checked(made, words, reading)))
        return made

    @property
    def needed(self) -> tuple[str, ...]:
        """The variables of which it takes the value."""
        return tuple(each for each in (self.first, self.second) if isinstance(each, str))

    def run(self, walk: Walk) -> ProgramFault | LetMark | None:
        if walk.ways is not None:
            return None
        if fault := _unset(self.line, self.needed, walk):
            return fault
        value, second = _number(self.first, walk.variables), _number(self.second, walk.variables)
        if self.sign == "/" and second == 0.0:
            return ProgramFault(self.line, f"LET {self.name}: a division by {self.second}, which is 0 here")
        if self.sign:
            value = _SUMS[self.sign](value, second)
        if not abs(value) <= LARGEST:
            return ProgramFault(self.line, f"LET {self.name}: {value:g} is beyond -{LARGEST:g} to {LARGEST:g}")
        walk.variables[self.name] = value
        if not self.shared:
            return None
        walk.raised += 1
        return LetMark(self.line, self.name, value, walk.raised)


@statement("M")
@dataclass(frozen=True, slots=True)
class RaiseFlag(Statement):
    """`M n`, `M n ASYNC`: wait at rest until somebody answers this flag, or count it where the move before it ends."""

    flag: int
    waits: bool

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        if len(words) not in (2, 3) or (len(words) == 3 and words[2].text.upper() != "ASYNC"):
            found = f"`{' '.join(word.text for word in words)}`"
            raise Mistake(words[0].column, found, f"M and a number, 0 to {HIGHEST_FLAG}; if wanted, ASYNC")
        flag = number(words[1].text, words[1])
        if flag != int(flag) or not 0 <= flag <= HIGHEST_FLAG:
            raise Mistake(words[1].column, f"M {words[1].text}", f"a whole number, 0 to {HIGHEST_FLAG}")
        return cls(line, int(flag), len(words) == 2)

    def run(self, walk: Walk) -> AwaitAnswer | FlagMark:
        if self.waits:
            return AwaitAnswer(self.line, self.flag)
        walk.raised += 1
        return FlagMark(self.line, self.flag, walk.raised)


@statement("LOOKAHEAD")
@dataclass(frozen=True, slots=True)
class LookAhead(Statement):
    """`LOOKAHEAD 1`, `LOOKAHEAD 0`: from here on IF is decided ahead of the motion, or where the robot is then."""

    on: bool

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        if len(words) != 2 or words[1].text not in ("0", "1"):
            found = f"`{' '.join(word.text for word in words)}`"
            raise Mistake(words[0].column, found, "LOOKAHEAD 1 or LOOKAHEAD 0")
        return cls(line, words[1].text == "1")

    def run(self, walk: Walk) -> None:
        walk.ahead = self.on


def _tokens(words: list[Word], pattern: re.Pattern[str]) -> list[Word]:
    """Words of a program parted further, each with its column."""
    return [Word(m.group(), word.column + m.start()) for word in words for m in pattern.finditer(word.text)]


def _condition(words: list[Word], reading: Reading) -> Condition:
    parts: list[list[Word]] = [[]]
    joints: list[Word] = []
    for token in _tokens(words[1:], _COMPARED):
        if token.text.upper() in ("AND", "OR"):
            joints.append(token)
            parts.append([])
        else:
            parts[-1].append(token)
    other = next((each for each in joints if each.text.upper() != joints[0].text.upper()), None)
    if other is not None:
        raise Mistake(other.column, "AND and OR in one condition", "one of them; a second IF for the rest")
    before = [words[0], *joints]
    terms = tuple(_term(part, where, reading) for part, where in zip(parts, before, strict=True))
    return Condition(terms, bool(joints) and joints[0].text.upper() == "OR")


def _term(tokens: list[Word], before: Word, reading: Reading) -> Comparison | Asked:
    """One term; `before` is the word in front of it."""
    if not tokens:
        raise Mistake(before.column, f"{before.text.upper()} without a condition after it", _CONDITION)
    negated = tokens[0].text.upper() == "NOT"
    for kind in ("DI", "DO"):
        named = signal_name(tokens, int(negated), kind)
        if named is not None and named[1] == len(tokens):
            return Asked(_known(named[0], kind, reading), not negated)
    if negated or len(tokens) != 3 or tokens[1].text not in COMPARISONS:
        raise Mistake(tokens[0].column, f"`{' '.join(token.text for token in tokens)}`", _CONDITION)
    left, right = _compared(tokens[0]), _compared(tokens[2])
    foreign = {each for each in (left, right) if isinstance(each, str) and reading.names.sets(each) is False}
    return Comparison(left, tokens[1].text, right, frozenset(foreign))


def _known(name: Word, kind: str, reading: Reading) -> Signal:
    """The input (DI, or a key instead of one) or output (DO) of a name. Raises Mistake where nobody knows it."""
    names, is_input = reading.names, kind == "DI"
    if is_input and (key := names.key(name.text)) is not None:
        return Signal("KEY", key.name, key.fresh_s)
    what, known = ("input", names.inputs) if is_input else ("output", names.outputs)
    asked = names.input(name.text) if is_input else names.output(name.text)
    if known is not None and asked not in known:
        raise unknown(name, what, known, "none: this robot has none in its drives file")
    return Signal(kind, asked)


def _compared(token: Word) -> Value:
    return _variable(token) if _VARIABLE.match(token.text) else number(token.text, token)


def _operand(tokens: list[Word]) -> tuple[Value, list[Word]]:
    """The number or variable with which tokens of a LET begin, and the others."""
    sign = tokens[0].text if tokens[0].text in ("+", "-") and tokens[1:] else ""
    value, rest = tokens[bool(sign)], tokens[1 + bool(sign) :]
    if not sign and _VARIABLE.match(value.text):
        return _variable(value), rest
    return number(sign + value.text, value), rest


def _variable(token: Word) -> str:
    """The name of a variable; one that means something else is none."""
    if not _VARIABLE.match(token.text) or token.text.upper() in _RESERVED or _ONE_WORD.match(token.text):
        allowed = "the name of a variable: letters, digits and _, starting with a letter, and no word of a condition"
        raise Mistake(token.column, f"`{token.text}`", allowed)
    return token.text


def _checked(made: Let, words: list[Word], reading: Reading) -> Let:
    _check_set(words, made.needed, reading)
    return made


def _check_set(words: list[Word], names: tuple[str, ...], reading: Reading) -> None:
    """Raises Mistake for a variable that no LET of the program sets."""
    for name in names:
        if reading.names.sets(name) is False:
            sets = f"the variable `{name}`, which robot {reading.names.variables[name]} sets"
            raise Mistake(words[0].column, sets, "a variable of this robot; those of others in IF")
        if name not in reading.variables and name not in reading.names.variables:
            known = ", ".join(sorted(reading.variables)) or "no LET sets any"
            column = next((each.column for each in _tokens(words[1:], _COUNTED) if each.text == name), words[0].column)
            raise Mistake(column, f"the variable `{name}`, which is never set", f"a variable of a LET: {known}")


def _unset(line: int, names: tuple[str, ...], walk: Walk) -> ProgramFault | None:
    missing = next((name for name in names if name not in walk.variables), None)
    if missing is None:
        return None
    return ProgramFault(line, f"the variable {missing} is not set yet when the program comes here: LET it first")


def _innermost(words: list[Word], reading: Reading) -> Branches:
    """The branches of the IF in which an ELSE or ENDIF stands."""
    if not reading.ifs:
        raise Mistake(words[0].column, f"{words[0].text.upper()} without an IF before it", "IF first")
    return reading.ifs[-1]


def _alone(words: list[Word]) -> None:
    if len(words) > 1:
        raise Mistake(words[1].column, f"`{words[1].text}` after {words[0].text.upper()}", "nothing")


def _number(value: Value, variables: Mapping[str, float]) -> float:
    return variables[value] if isinstance(value, str) else value
