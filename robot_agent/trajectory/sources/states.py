"""What a source of set points gives: joint states, tick by tick."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.governor.segment import RESTING_SAMPLES


@dataclass(frozen=True, slots=True, eq=False)
class JointState:
    """Position, velocity and acceleration of the joints, `(n,)` each [rad or m, s]."""

    q: NDArray[np.float64]
    qd: NDArray[np.float64]
    qdd: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class States:
    """Joint states of consecutive ticks, `(m, n)` each [rad or m, s]."""

    q: NDArray[np.float64]
    qd: NDArray[np.float64]
    qdd: NDArray[np.float64]

    @classmethod
    def standing(cls, q: NDArray[np.float64], count: int = RESTING_SAMPLES) -> "States":
        """At rest at `q` `(n,)`."""
        return cls(np.repeat(q[None], count, axis=0), np.zeros((count, len(q))), np.zeros((count, len(q))))

    @classmethod
    def one(cls, state: JointState) -> "States":
        """A single state."""
        return cls(state.q[None], state.qd[None], state.qdd[None])

    @property
    def count(self) -> int:
        return len(self.q)

    def at(self, index: int) -> JointState:
        """The state at tick `index`; after the last one the joints rest where that is."""
        k = min(index, self.count - 1)
        return JointState(self.q[k], self.qd[k], self.qdd[k])

    def first(self, count: int) -> "States":
        """The first `count` states; after the last one the joints rest where that is."""
        kept = States(self.q[:count], self.qd[:count], self.qdd[:count])
        missing = count - kept.count
        return kept if missing <= 0 else kept.then(States.standing(self.q[-1], missing))

    def after(self, count: int) -> "States":
        """What comes after the first `count` states; at least one state, at rest when all is over."""
        if count >= self.count:
            return States.standing(self.q[-1], 1)
        return States(self.q[count:], self.qd[count:], self.qdd[count:])

    def then(self, following: "States") -> "States":
        """These states and the following ones."""
        return States(
            np.concatenate([self.q, following.q]),
            np.concatenate([self.qd, following.qd]),
            np.concatenate([self.qdd, following.qdd]),
        )
