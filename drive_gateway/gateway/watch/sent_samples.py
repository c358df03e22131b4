"""The samples that were sent last, so that a measured position is compared with the one that it answers."""

from collections.abc import Sequence

import numpy as np

from drive_gateway.gateway.watch.measurement import Floats


class SentSamples:
    """Newest samples of one robot, `(n,)` [rad or m] each; at first, all are where it stands.

    Args:
        start: `(n,)` [rad or m].
        delays: cycles from a sample to the position that shows it, of each axis.
    """

    def __init__(self, start: Floats, delays: Sequence[int]) -> None:
        self._depth = max(delays) + 1
        self._kept: Floats = np.tile(start, (self._depth, 1))
        self._delays = np.array(delays)
        self._axes = np.arange(len(delays))
        self._row = 0

    def add(self, sample: Floats) -> None:
        """The sample of the present cycle goes out."""
        self._row = (self._row + 1) % self._depth
        self._kept[self._row] = sample

    @property
    def newest(self) -> Floats:
        """`(n,)` [rad or m] a copy."""
        sample: Floats = self._kept[self._row].copy()
        return sample

    @property
    def answered(self) -> Floats:
        """`(n,)` [rad or m] what each axis was told so long ago that its newest position shows it."""
        samples: Floats = self._kept[(self._row - self._delays) % self._depth, self._axes]
        return samples
