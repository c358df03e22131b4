"""Orders for a plan, to the planning process, and what comes of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cell.core import Effect
from cell.messages import FramePose, ZoneGeometry
from robot_agent.agent.parameters import AS_FILED, Tuning
from robot_agent.language import Mark, MotionStep
from robot_agent.model.description import NOTHING, Mounted
from robot_agent.trajectory import Motion
from robot_agent.workspace import Crossing, MotionSections, Sweep


class _Steps:
    """Steps that are planned together, with one tool and one part."""

    __slots__ = ()
    steps: tuple[MotionStep, ...]

    @property
    def mounted(self) -> Mounted:
        """What is mounted during all steps."""
        return self.steps[0].mounted

    @property
    def line(self) -> int:
        """The program line of the first step."""
        return self.steps[0].line


@dataclass(frozen=True, slots=True, eq=False)
class PlanRequest(_Steps):
    """Plan consecutive steps from rest at `start` `(n,)` to rest."""

    id: int
    steps: tuple[MotionStep, ...]
    start: NDArray[np.float64]
    zones: tuple[ZoneGeometry, ...]
    frames: tuple[FramePose, ...] = ()
    """Where the frames are in which things stand; without them things are where the cell file says."""
    tuning: Tuning = AS_FILED
    """What an operator has set."""
    beyond: tuple[MotionStep, ...] = ()
    """What comes after the steps: lines within a tolerance and splines are led towards it."""
    aimed: NDArray[np.float64] | None = None
    """The pose `(4, 4)` to which the step before led, where the robot may be beside it."""


@dataclass(frozen=True, slots=True, eq=False)
class ExtendRequest(_Steps):
    """Plan steps that go on from a motion in full motion at its tau `splice_s` [s]; its tau up to `cut_s` is forgotten.

    `cut_s` is at most `splice_s`.
    """

    id: int
    steps: tuple[MotionStep, ...]
    motion: Motion
    lines: tuple[int, ...]
    """The program line of each move of the motion."""
    switches: tuple[tuple[Mark, ...], ...]
    """What is switched at the end of each of them."""
    splice_s: float
    cut_s: float
    first_tau: float
    """Of the motion, as in `Planned`."""
    zones: tuple[ZoneGeometry, ...]
    frames: tuple[FramePose, ...] = ()
    """As in `PlanRequest`."""
    sections: MotionSections | None = None
    """Of the motion."""
    tuning: Tuning = AS_FILED
    """That with which the motion was planned."""
    beyond: tuple[MotionStep, ...] = ()
    """As in `PlanRequest`."""
    aimed: NDArray[np.float64] | None = None
    """As in `PlanRequest`."""

    @property
    def start(self) -> NDArray[np.float64]:
        """Joints `(n,)` where the steps begin."""
        return self.motion.q(np.array(self.motion.duration_s))


@dataclass(frozen=True, slots=True, eq=False)
class Plan(Effect):
    """The shell's worker plans; `Planned`, `Extended` or `PlanFailed` with the same id comes back."""

    request: PlanRequest | ExtendRequest


@dataclass(frozen=True, slots=True, eq=False)
class Unplan(Effect):
    """Nobody waits for the plans with these ids any more."""

    ids: tuple[int, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Planned:
    """A motion, the body it sweeps in world, and where on it the zones of the request are entered and left."""

    id: int
    lines: tuple[int, ...]
    """The program line of each move of the motion; 0 for none."""
    motion: Motion
    taus: NDArray[np.float64]
    """`(m,)` path time [s] of each sample of the sweep, from 0 to the end."""
    sweep: Sweep
    crossings: tuple[Crossing, ...]
    zone_versions: dict[str, int]
    first_tau: float = 0.0
    """The tau [s] that may not be passed backwards; what lies before it is not known any more."""
    switches: tuple[tuple[Mark, ...], ...] = ()
    """What is done at the end of each move of a motion that a program asked for, or in front of that."""
    places: tuple[tuple[float, Mark], ...] = ()
    """The same with its tau [s], in the order of the program."""
    spaces_off: frozenset[str] = frozenset()
    """Spaces that the program had switched off."""
    mounted: Mounted = NOTHING
    """The part that the robot holds; several where it may be any of them."""
    shut: tuple[Crossing, ...] = ()
    """Where it enters and leaves spaces that an input switches."""
    sections: MotionSections | None = None
    """What it takes of the cell's space; None for samples that no plan has cut, and where robots are not kept apart."""
    aimed: NDArray[np.float64] | None = None
    """The pose `(4, 4)` to which its last step leads, where the motion may end beside it."""

    def line_at(self, tau: float) -> int:
        """The program line that path time `tau` [s] lies in."""
        return self.lines[int(self.motion.move_at(np.array(tau)))]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Extended(Planned):
    """A motion that takes the place of the one that it extends while that runs: the same up to `splice_s` [s].

    Its tau 0 is tau `cut_s` of the other one, and `splice_s` counts as its own tau does.
    """

    cut_s: float
    splice_s: float


@dataclass(frozen=True, slots=True)
class PlanFailed:
    """Why a step cannot be planned, for people."""

    id: int
    line: int
    text: str
    step: int = 0
    """Its index among the steps of the request; 0 also where nobody knows it."""
