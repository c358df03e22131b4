"""The judge of the whole-cell simulation: everything that must hold at every step, whatever happens to the cell.

It looks at the drives themselves, at each message that leaves a process and at each that reaches one. It must not know
how the cores come to what they say.
"""

from tests.sim.judge.invariant import Broken, Invariant
from tests.sim.judge.judge import ALL, Judge

__all__ = ["ALL", "Broken", "Invariant", "Judge"]
