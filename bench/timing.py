"""How long something takes, and how it is printed."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Row:
    """One measurement: its time, and its ratio to a peer library or to the deadline it must keep."""

    what: str
    seconds: float
    ratio: float
    to: str

    def cells(self) -> tuple[str, str, str, str]:
        time_text = f"{1e3 * self.seconds:.3f} ms" if self.seconds >= 1e-4 else f"{1e6 * self.seconds:.2f} us"
        return self.what, time_text, f"{self.ratio:.3g}", self.to


def median_s(work: Callable[[], object], repeats: int = 15) -> float:
    """Median time of one call [s], after one call that does not count."""
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return float(np.median(times))
