"""Homing as a drive does it (CiA 402, mode 6): fast to a switch, slowly off it, home at its edge or an index pulse.

The method of 6098h says which switch, on which side it is left, and whether home is the first index pulse after its
edge. Methods 33 and 34 look for a pulse only, 35 and 37 take the place where the axis stands.
"""

from dataclasses import dataclass
from enum import Enum

from drive_gateway.sim.drives.profile import Profile
from drive_gateway.sim.drives.reference import METHODS, Look, Reference


class HomingState(Enum):
    IDLE = "not started"
    SEARCHING = "fast towards the switch"
    LEAVING = "slowly off the switch"
    ENTERING = "slowly onto the switch again"
    INDEXING = "slowly to the index pulse"
    BRAKING = "home was found"
    ATTAINED = "referenced"
    FAILED = "not referenced"


@dataclass(frozen=True, slots=True)
class HomingSpeeds:
    """6099h and 609Ah, in counts."""

    fast: float
    slow: float
    ramp: float


class Homing:
    """One homing run. An edge and a pulse are latched where they are; the speed of the axis does not matter."""

    def __init__(self, reference: Reference, profile: Profile) -> None:
        self._reference = reference
        self._switches = reference.switches
        self._profile = profile
        self._method = METHODS[35]
        self._direction = -1.0
        self._reversed = False
        self._seen = False
        self._before = 0.0
        self.keeps_result = False
        """What the last homing ended with is shown until the next one begins."""
        self.state = HomingState.IDLE

    def idle(self) -> None:
        if not self.keeps_result:
            self.state = HomingState.IDLE

    def start(self, number: int, place: float) -> None:
        """Begin at `place`; a method that the drive or its encoder does not have fails at once."""
        method = METHODS.get(number)
        if method is None or (method.pulse and not self._switches.index):
            self.state = HomingState.FAILED
            return
        self._method = method
        self._direction = method.first
        self._reversed = self._seen = False
        self._before = place
        self.state = HomingState.INDEXING if method.look is Look.PULSE else HomingState.SEARCHING

    def abort(self) -> None:
        """The start bit fell, or halt: the axis brakes and is not referenced."""
        if self.state in (HomingState.SEARCHING, HomingState.LEAVING, HomingState.ENTERING, HomingState.INDEXING):
            self.state = HomingState.FAILED

    def step(self, place: float, speeds: HomingSpeeds, offset: int, step_s: float) -> None:
        """One step. `place` is where the axis is [counts], `offset` is 607Ch."""
        velocity = 0.0
        match self.state:
            case HomingState.SEARCHING if self._method.look is Look.HERE:
                self._found(place, offset)
            case HomingState.SEARCHING:
                velocity = self._direction * speeds.fast
                self._search(place)
            case HomingState.LEAVING:
                velocity = speeds.slow * self._method.away
                self._leave(place, offset)
            case HomingState.ENTERING:
                velocity = speeds.slow * self._method.last
                self._enter(place, offset)
            case HomingState.INDEXING:
                velocity = speeds.slow * self._method.last
                self._look_for_pulse(place, offset)
        self._before = place
        self._profile.run(velocity, speeds.ramp, step_s)
        if self.state is HomingState.BRAKING and self._profile.velocity == 0.0:
            self.state = HomingState.ATTAINED

    def _found(self, home: float, offset: int) -> None:
        self._reference.found(home, offset)
        self.state = HomingState.BRAKING

    def _active(self, place: float) -> bool:
        if self._method.look is not Look.LIMIT:
            return self._switches.home[0] <= place <= self._switches.home[1]
        return self._switches.at_limit(place, self._direction)

    def _search(self, place: float) -> None:
        if self._active(place):
            self._seen = True
            self.state = HomingState.LEAVING
        elif self._method.look is not Look.LIMIT and self._switches.at_limit(place, self._direction):
            if self._reversed:
                self.state = HomingState.FAILED
            self._reversed = True
            self._direction = -self._direction

    def _leave(self, place: float, offset: int) -> None:
        if self._active(place):
            self._seen = True
            return
        # It may have shot over the cam while it braked; then it comes back to it first.
        edge = self._switches.edge(self._method)
        if self._seen and (place - edge) * self._method.away > 0.0:
            if self._method.inward:
                self.state = HomingState.ENTERING
            else:
                self._at_edge(edge, place, offset)
        elif self._method.look is not Look.LIMIT and self._switches.at_any_limit(place):
            self.state = HomingState.FAILED

    def _enter(self, place: float, offset: int) -> None:
        edge = self._switches.edge(self._method)
        if (place - edge) * self._method.last >= 0.0:
            self._at_edge(edge, place, offset)

    def _at_edge(self, edge: float, place: float, offset: int) -> None:
        if not self._method.pulse:
            self._found(edge, offset)
            return
        self._before = edge
        self.state = HomingState.INDEXING
        self._look_for_pulse(place, offset)

    def _look_for_pulse(self, place: float, offset: int) -> None:
        """The first pulse that the axis passes, or has passed since the edge."""
        pulse = self._switches.pulse_between(self._before, place)
        if pulse is not None and (place - self._before) * self._method.last > 0.0:
            self._found(pulse, offset)
        elif self._switches.at_limit(place, self._method.last):
            self.state = HomingState.FAILED
