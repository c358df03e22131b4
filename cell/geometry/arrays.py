"""The array types of geometry and kinematics, and the memory they live in."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]

KEPT_BYTES = 4 << 20


def keep_freed_memory() -> None:
    """Let this process keep the memory of freed arrays for the next ones; asking the system for it anew costs more time
    than the formulas that fill it.

    The allocator of glibc keeps blocks as large as the largest that was ever freed, at first 128 KiB, and twice as much
    in all (mallopt(3), M_MMAP_THRESHOLD): so one larger block is freed here, untouched. Other allocators do not mind.
    """
    np.empty(KEPT_BYTES, dtype=np.uint8)
