"""A motion and the one that goes on from it, as one."""

from dataclasses import replace

import numpy as np

from robot_agent.paths.transition import in_order
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.motion import Motion


def spliced(motion: Motion, tau: float, onward: Motion, first: float = 0.0) -> Motion:
    """`motion` from tau `first` up to `tau` [s], and from there on `onward`, planned from its state there.

    Its tau 0 is tau `first` of `motion`, where it may begin in motion; between there and `tau` it is the same motion.
    Moves that have ended by `first` are left out.
    """
    before = np.searchsorted(motion.ends, [first, tau], side="right")
    offset = tau - first
    moves = int(before[1] - before[0])
    ends = np.append(motion.ends[before[0] : before[1]] - first, onward.ends + offset)
    kept = motion.rests[(motion.rests > first) & (motion.rests <= tau)] - first
    inside = [each for each in motion.transitions if before[0] <= each.before and each.move <= before[1]]
    return replace(
        onward,
        pieces=Pieces.joined([motion.pieces.part(first, tau), onward.pieces]),
        ends=ends,
        rests=np.concatenate([[0.0], kept, onward.rests[1:] + offset]),
        transitions=in_order(
            [
                *(each.shifted(-int(before[0])) for each in inside),
                *(each.shifted(moves) for each in onward.transitions),
            ]
        ),
        filter_deviation_m=max(motion.filter_deviation_m, onward.filter_deviation_m),
        last=None if onward.last is None else onward.last.later(offset, moves),
    )
