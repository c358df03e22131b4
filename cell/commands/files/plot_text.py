"""What `cell plot` says in words: how far each move goes, and how one meets the next."""

from collections import Counter
from collections.abc import Iterable, Mapping

import numpy as np

from robot_agent.agent.planning.plans import Planned
from robot_agent.paths import Passing, Transition
from robot_agent.trajectory import move_lengths

_VISIBLE_RAD = 1e-4


def moves(motions: list[Planned]) -> list[str]:
    """Way, rotation, way of the joints and time of each move; equal ones in one line."""
    texts = []
    for planned in motions:
        covered = move_lengths(planned.motion) * [1000.0, *np.degrees([1.0, 1.0])]
        times = np.diff(planned.motion.ends, prepend=0.0)
        for line, (way, turn, joints), time_s in zip(planned.lines, covered, times, strict=True):
            texts.append(f"line {line}: {way:.1f} mm, {turn:.1f} deg, joints {joints:.1f} deg, {time_s:.3f} s")
    return _counted(texts)


def transitions(motions: list[Planned], reasons: Mapping[tuple[int, int], str]) -> list[str]:
    """How each move meets the next one; equal ones in one line.

    `reasons` are why moves are planned by themselves, by the lines of both.
    """
    texts = []
    for number, planned in enumerate(motions):
        texts += [_meeting(planned, each) for each in planned.motion.transitions]
        if number + 1 < len(motions):
            before, after = planned.lines[-1], motions[number + 1].lines[0]
            why = reasons.get((before, after), "")
            texts.append(
                f"line {before} to {after}: stops, the next move is planned by itself" + (f" ({why})" if why else "")
            )
    return _counted(texts)


def stops(motions: list[Planned]) -> int:
    """How often the robot stops inside the motions."""
    return sum(each.passing is Passing.STOPS for planned in motions for each in planned.motion.transitions)


def _meeting(planned: Planned, transition: Transition) -> str:
    before, after = planned.lines[transition.before], planned.lines[transition.move]
    where = f"within line {after}" if transition.before == transition.move else f"line {before} to {after}"
    parts = [f"{where}: {transition.continuity.value}, {transition.passing.value}"]
    if transition.passing is Passing.ROUNDED:
        parts.append(f"{1000.0 * transition.deviation_m:.2f} mm beside it")
    elif transition.deviation_m > 0.0:
        parts.append(f"at most {1e6 * transition.deviation_m:.0f} um away")
    if transition.deviation_rad > _VISIBLE_RAD:
        parts.append(f"turned at most {np.degrees(transition.deviation_rad):.2f} deg beside it")
    return ", ".join(parts) + (f" ({transition.reason})" if transition.reason else "")


def _counted(texts: Iterable[str]) -> list[str]:
    return [text if count == 1 else f"{text}; {count} times" for text, count in Counter(texts).items()]
