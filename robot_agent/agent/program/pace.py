"""How fast, how far and in which direction an operator lets a robot follow its path."""

import math
from dataclasses import dataclass

import numpy as np

from cell.messages import PaceStatus
from robot_agent.agent.blocks.motion_source import SentBlock
from robot_agent.agent.parameters import Parameters
from robot_agent.agent.planning.plans import Planned
from robot_agent.trajectory import Hold, RateRequest, Segment

_AT_END_S = 1e-5
_FORGOTTEN = "the path farther back is not known any more"
_STEP = "step: the block ends here"


@dataclass(frozen=True, slots=True)
class _StepEnd:
    """Where a step ends: on which motion, at which tau [s], approached forwards or backwards."""

    planned: Planned
    tau: float
    backwards: bool

    def hold(self) -> Hold:
        return Hold(-math.inf, _STEP, until=self.tau) if self.backwards else Hold(self.tau, _STEP)


class Pace:
    """Kept over programs and stops, until an operator says otherwise or the agent ends."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self.override = 1.0
        """Share of the planned speed, -1 to 1; negative goes back along the path."""
        self.manual = False
        self._stepping = False
        self._end: _StepEnd | None = None

    def follow(self, other: "Pace") -> None:
        """Speed and direction as an operator has set them there."""
        self.override, self.manual = other.override, other.manual

    @property
    def status(self) -> PaceStatus:
        return PaceStatus(self.override, self.manual, self._stepping)

    @property
    def requests(self) -> tuple[RateRequest, ...]:
        return () if self.override == 1.0 else (RateRequest(self.override, f"override {100.0 * self.override:.0f} %"),)

    @property
    def manual_speed_m_s(self) -> float:
        """The bound in manual operation."""
        return self._parameters.manual_speed_m_s

    @property
    def cap_m_s(self) -> float | None:
        """The bound on the speed of the TCP."""
        return self.manual_speed_m_s if self.manual else None

    @property
    def backwards(self) -> bool:
        return self.override < 0.0

    def step(self) -> None:
        """Go on to the end of a block, and no farther."""
        self._stepping, self._end = True, None

    def no_step(self) -> None:
        """Go on without an end of a step."""
        self._stepping, self._end = False, None

    def holds(self, planned: Planned, segment: Segment, index: int) -> list[Hold]:
        """Where what is known of a motion begins, and where a step ends on it at sample `index` of `segment`.

        No motion after that one is begun.
        """
        first = planned.first_tau
        known = [Hold(-math.inf, _FORGOTTEN, until=first)] if first > 0.0 else []
        if not self._stepping:
            return known
        end = self._end
        if end is None or end.backwards is not self.backwards:
            end = self._end = self._next_end(planned, segment, index)
        if end is None:
            return known
        return [*known, end.hold() if end.planned is planned else Hold(0.0, _STEP)]

    def forgotten(self, planned: Planned, tau: float) -> str:
        """Why a robot goes back no farther from `tau` [s] of a motion; empty where what lies behind is known."""
        return _FORGOTTEN if planned.first_tau > 0.0 and tau <= planned.first_tau + _AT_END_S else ""

    def _next_end(self, planned: Planned, segment: Segment, index: int) -> _StepEnd | None:
        """The next border of two blocks that braking still allows for; None where only another motion has one."""
        borders = np.concatenate([[planned.first_tau], planned.motion.ends])
        tau = segment.stop_tau
        gap = _AT_END_S if tau == segment.state(index).tau else -_AT_END_S
        if self.backwards:
            before = borders[borders < tau - gap]
            return _StepEnd(planned, float(before[-1]), True) if len(before) else None
        after = borders[borders > tau + gap]
        return _StepEnd(planned, float(after[0]), False) if len(after) else None

    def step_done(self, newest: SentBlock) -> bool:
        """Whether the newest accepted block ends where the step does; to be asked when path time stands."""
        end = self._end
        return (
            end is not None and newest.path is end.planned and abs(newest.path_segment.stop_tau - end.tau) <= _AT_END_S
        )
