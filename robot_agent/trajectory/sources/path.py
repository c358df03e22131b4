"""A path under the governor as a motion source."""

from collections.abc import Sequence

from robot_agent.trajectory.governor.governor import Governor, Hold, RateRequest
from robot_agent.trajectory.governor.segment import Segment
from robot_agent.trajectory.motion import Motion
from robot_agent.trajectory.sources.sampled import states_from
from robot_agent.trajectory.sources.source import JointState, States


class PathSource:
    """Follows one planned motion; requests and holds are the governor's."""

    def __init__(self, motion: Motion, governor: Governor, segment: Segment, index: int = 0) -> None:
        """Begin at sample `index` of `segment`, which `governor` gave for `motion`."""
        self._motion = motion
        self._governor = governor
        self._segment = segment
        self._index = index
        self.requests: Sequence[RateRequest] = ()
        self.holds: Sequence[Hold] = ()

    @property
    def tau(self) -> float:
        """Path time [s] of `state`."""
        return self._segment.state(self._index).tau

    @property
    def at_end(self) -> bool:
        """Whether the motion is played to its end."""
        return self.tau >= self._motion.duration_s

    @property
    def state(self) -> JointState:
        return states_from(self._motion, self._segment, self._index).at(0)

    @property
    def ruled_by(self) -> str:
        return self._segment.ruled_by

    def samples(self, count: int) -> States:
        """The next `count` ticks; the governor is asked anew when the nominal part of its answer is used up.

        An answer without one is a stop, which is followed to its end.
        """
        given: States | None = None
        while given is None or given.count < count:
            self._segment = self._governor.next(self._segment, self._index, self.requests, self.holds)
            missing = count - (0 if given is None else given.count)
            step = min(missing, self._segment.nominal or missing)
            part = states_from(self._motion, self._segment, 0).behind(1).first(step)
            self._index = step
            given = part if given is None else given.then(part)
        return given

    def brake(self) -> States:
        """The faster of the ramp that the governor gave and a stop at once; both stay on the path."""
        stop = self._governor.next(self._segment, self._index, (), (), stop=True)
        return states_from(self._motion, stop, 0).behind(1)
