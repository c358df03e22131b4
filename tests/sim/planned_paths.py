"""How far commanded joints are from the paths that were planned, many samples at once."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from robot_agent.trajectory import Motion

PATH_STEP_S = 0.001


class _Chords:
    """The path of one motion, sampled densely."""

    def __init__(self, motion: Motion) -> None:
        count = max(2, int(motion.duration_s / PATH_STEP_S))
        self.motion = motion
        self.points = motion.q(np.linspace(0.0, motion.duration_s, count))
        self.ways = np.diff(self.points, axis=0)
        self._tree = KDTree(self.points, balanced_tree=False)
        self._half_a_chord = np.abs(self.ways).max() / 2

    def off(self, q: NDArray[np.float64], allowed: float) -> NDArray[np.float64]:
        """Distance `(m,)` of joints `(m, n)` from the nearest chord; infinite where none is within `allowed`.

        Every chord that is so near has an end in the ball that is searched: a path may pass a place more than once.
        """
        near = self._tree.query_ball_point(q, self._half_a_chord + allowed, p=np.inf)
        sample = np.repeat(np.arange(len(q)), [len(each) for each in near])
        point = np.concatenate(near).astype(int)
        chord = np.clip([point - 1, point], 0, len(self.ways) - 1)
        start, way = self.points[chord], self.ways[chord]
        share = np.clip(((q[sample] - start) * way).sum(-1) / np.maximum((way * way).sum(-1), 1e-30), 0.0, 1.0)
        away = np.abs(start + share[..., None] * way - q[sample]).max(-1).min(0)
        nearest = np.full(len(q), np.inf)
        np.minimum.at(nearest, sample, away)
        return nearest


class PlannedPaths:
    """The paths of all motions; each is sampled once."""

    def __init__(self) -> None:
        self._chords: dict[int, _Chords] = {}

    def off(self, motions: Sequence[Motion], q: NDArray[np.float64], allowed: float) -> NDArray[np.float64]:
        """Distance `(m,)` [rad] of joints `(m, n)` from the nearest path; it may be infinite beyond `allowed`.

        The newest motions are last. A sample that is on one is not compared with older ones.
        """
        nearest = np.full(len(q), np.inf)
        for motion in reversed(motions):
            left = nearest > allowed
            if not left.any():
                break
            nearest[left] = np.minimum(nearest[left], self._of(motion).off(q[left], allowed))
        return nearest

    def _of(self, motion: Motion) -> _Chords:
        if id(motion) not in self._chords:
            self._chords[id(motion)] = _Chords(motion)
        return self._chords[id(motion)]
