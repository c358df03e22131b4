"""How two moves meet: how far they go on as one, and what the robot does there."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import Enum


class Continuity(Enum):
    """Of two moves as they are programmed, judged by what the joints feel, so the orientation counts too."""

    C0 = "C0"
    """Only the place: the direction steps, or how fast the TCP turns on its way."""
    C1 = "C1"
    """Place and direction; the curvature steps, and with it the acceleration at constant speed."""
    C2 = "C2"
    """Place, direction and curvature."""


class Passing(Enum):
    """What the robot does where two moves meet."""

    STOPS = "stops"
    ROUNDED = "rounds the corner"
    BLENDED = "passes blended"
    THROUGH = "passes"
    FITTED = "passes within the tolerance"
    """From one move to another, and all between them."""


@dataclass(frozen=True, slots=True)
class Transition:
    """Where move `before` ends and move `move` begins, both counted from 0; one number at a via inside a move."""

    before: int
    move: int
    continuity: Continuity
    passing: Passing
    reason: str
    """What steps there, and why the robot stops, for people; empty where nothing does."""
    deviation_m: float = 0.0
    """How far at most the path leaves the moves where it is blended, or passes a rounded corner."""
    deviation_rad: float = 0.0
    """How far at most the TCP turns from its programmed orientation after the same way, where its rate is blended, to
    both sides of the border; at the border it has the programmed one."""

    cut_m: float = 0.0
    """How far from the corner a round edge begins and ends."""

    def shifted(self, moves: int) -> "Transition":
        """The same with so many moves more before it; a move that would come before all others becomes the first."""
        return replace(self, before=max(self.before + moves, 0), move=self.move + moves)


def in_order(transitions: Iterable[Transition]) -> tuple[Transition, ...]:
    """Each once, by their moves."""
    return tuple(sorted(dict.fromkeys(transitions), key=lambda each: (each.move, each.before)))
