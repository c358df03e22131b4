"""How far a robot is from the stretch of a path on which it was stopped."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cell.config.settings import PathWindow
from robot_agent.agent.blocks.executive import Executive
from robot_agent.agent.planning.plans import Planned
from robot_agent.kinematics import Model

_LAG_S = 0.1
"""How far behind the commanded position a robot may be when it stops (as in the body that is published)."""
_SAMPLES = 501


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """The stretch of a planned motion, from `first_tau` to `last_tau` [s], on which a robot is or comes to rest."""

    planned: Planned
    first_tau: float
    last_tau: float
    left_tau: float
    """Where on it the robot is commanded to be at present."""

    @classmethod
    def of(cls, executive: Executive, tick: int) -> Self | None:
        """Of a robot that is supplied with blocks of its program; it plays them at `tick`. None where it is led."""
        block, _ = executive.timeline.at(tick)
        if block.followed is not None:
            return None
        spans = executive.timeline.spans(tick - round(_LAG_S / executive.cycle_s))
        span = next(each for each in spans if each.planned.motion is block.path.motion)
        return cls(block.path, span.first_tau, span.last_tau, block.path_state(tick).tau)


@dataclass(frozen=True, slots=True, eq=False)
class Gap:
    """How far the farthest joint is from the nearest point of a stretch."""

    tau: float
    """Where to go on [s]: from that point if it is no farther than the window, else from where the path was left."""
    excess: float
    """That joint's distance by its window: at most 1 is on the path."""
    text: str
    """For people: `J2 is 0.31 deg beside its path`."""

    @classmethod
    def between(cls, stretch: Stretch, q: NDArray[np.float64], model: Model, window: PathWindow) -> Self:
        """Between joints `q` `(n,)` and a stretch; of equally near points the earliest."""
        motion, windows = stretch.planned.motion, np.where(model.linear, window.slide_m, window.turn_rad)
        low, high = stretch.first_tau, stretch.last_tau
        for _ in range(2):  # the second time between the neighbours of the nearest sample
            taus = np.linspace(low, high, _SAMPLES)
            away = np.abs(motion.q(taus) - q) / windows
            nearest = int(np.argmin(away.max(axis=1)))
            low, high = float(taus[max(nearest - 1, 0)]), float(taus[min(nearest + 1, _SAMPLES - 1)])
        joint = int(np.argmax(away[nearest]))
        distance = float(away[nearest, joint] * windows[joint])
        far = f"{1000.0 * distance:.2f} mm" if model.linear[joint] else f"{np.degrees(distance):.2f} deg"
        text = f"{model.joint_names[joint]} is {far} beside its path"
        excess = float(away[nearest, joint])
        return cls(float(taus[nearest]) if excess <= 1.0 else stretch.left_tau, excess, text)

    @property
    def on_path(self) -> bool:
        return self.excess <= 1.0
