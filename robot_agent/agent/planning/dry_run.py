"""A whole program planned without a cell: what the robot would do if nothing held it up."""

from collections.abc import Hashable
from dataclasses import replace

import numpy as np

from cell.config.settings import CellSettings
from cell.messages import FramePose
from robot_agent.agent.planning.lookahead import Lookahead, Waiting
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Extended, Plan, PlanFailed, Planned
from robot_agent.language import Finished, Program, ProgramFault, Ways, mounted_before

_ALL = 1_000_000
"""Steps read at once: nobody waits."""
_LOOKED_AT = 500
"""Places on a motion where it may be extended."""


def dry_run(
    planner: Planner,
    program: Program,
    longest_s: float,
    frames: tuple[FramePose, ...] = (),
    ways: Ways | None = None,
) -> tuple[list[Planned], PlanFailed | None]:
    """The motions of a program from home, its pauses left out, and the failure that ends it, if one does.

    The frames are all that the program names. It begins with the tool of the robot file and without a part, or with any
    part where DETACH comes first. A program that never ends is cut off once its motions last `longest_s`, or where it
    goes round without one. Inputs and variables are nobody's: at each fork of the program it goes by `ways`, the first
    time as if the condition held, then as if it did not.
    """
    lookahead = Lookahead(read_at_once=_ALL)
    before = mounted_before(program, planner.model.description)
    lookahead.start(program, np.asarray(planner.model.home), before, Ways() if ways is None else ways)
    motions: list[Planned] = []
    still = _Round()
    while sum(planned.motion.duration_s for planned in motions) < longest_s:
        effects = lookahead.fill(())
        for effect in effects:
            if isinstance(effect, Plan):
                lookahead.planned(planner.plan(replace(effect.request, frames=frames)))
        if effects:
            continue  # a plan that is too short is asked for again
        match lookahead.head:
            case Planned() as planned:
                motions.append(_as_it_runs(planner, lookahead, planned, longest_s, frames))
                if motions[-1].motion.duration_s > planner.cycle_s:  # less is what rounding leaves to do
                    still = _Round()
            case PlanFailed() as failed:
                return motions, failed
            case ProgramFault(line, text):
                return motions, PlanFailed(0, line, f"line {line}: {text}")
            case Finished() | Waiting() | None:
                break
            case _:
                pass
        lookahead.advance()
        if still.closes_at(lookahead.place):
            break
    return motions, None


def frames_of(cell: CellSettings) -> tuple[FramePose, ...]:
    """The frames where the cell file says."""
    return tuple(
        FramePose(name, 0, frame.parent, frame.pose.position_m, frame.pose.quaternion_xyzw)
        for name, frame in cell.frames.items()
    )


class _Round:
    """Finds the end of a round without a motion, by one place at a time that is kept for twice as long (Brent 1980)."""

    def __init__(self) -> None:
        self._kept: Hashable = None
        self._left = self._length = 1

    def closes_at(self, place: Hashable) -> bool:
        """Take the next place; whether the program was there before."""
        if place == self._kept:
            return True
        self._left -= 1
        if self._left == 0:
            self._kept = place
            self._length *= 2
            self._left = self._length
        return False


def _as_it_runs(
    planner: Planner, lookahead: Lookahead, planned: Planned, longest_s: float, frames: tuple[FramePose, ...]
) -> Planned:
    """A motion with all by which the robot would extend it meanwhile."""
    while lookahead.open is planned:
        longer = _extended(planner, lookahead, planned, frames) if planned.motion.duration_s < longest_s else None
        if longer is None:
            lookahead.close()
        else:
            planned = longer
    return planned


def _extended(
    planner: Planner, lookahead: Lookahead, planned: Planned, frames: tuple[FramePose, ...]
) -> Planned | None:
    ends = planned.motion.ends
    for sent_tau in ends[:: max(len(ends) // _LOOKED_AT, 1)].tolist():
        for effect in lookahead.extend((0.0, sent_tau), sent_tau, ()):
            if isinstance(effect, Plan):
                result = planner.plan(replace(effect.request, frames=frames))
                lookahead.extended(result, taken=isinstance(result, Extended))
                return result if isinstance(result, Extended) else None
    return None
