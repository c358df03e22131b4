"""Homing as a drive does it (CiA 402, mode 6): fast to a switch, slowly away from it, home where the switch lets go."""

from enum import Enum

from drive_gateway.sim.profile import Profile
from drive_gateway.sim.reference import HERE, HOME_FALLING, HOME_RISING, METHODS, NEGATIVE_LIMIT, Reference


class HomingState(Enum):
    IDLE = "not started"
    SEARCHING = "fast towards the switch"
    LEAVING = "slowly off the switch"
    BRAKING = "home was found"
    ATTAINED = "referenced"
    FAILED = "not referenced"


class Homing:
    """One homing run. The edge of a switch is latched where it is; the speed of the axis does not matter."""

    def __init__(self, reference: Reference, profile: Profile) -> None:
        self._reference = reference
        self._profile = profile
        self._method = 0
        self._direction = -1.0
        self._reversed = False
        self._seen = False
        self.state = HomingState.IDLE

    def idle(self) -> None:
        self.state = HomingState.IDLE

    def start(self, method: int) -> None:
        """Begin; a method that the drive does not know fails at once."""
        self._method = method
        self._direction = -1.0 if method in (NEGATIVE_LIMIT, HOME_FALLING) else 1.0
        self._reversed = self._seen = False
        self.state = HomingState.SEARCHING if method in METHODS else HomingState.FAILED

    def abort(self) -> None:
        """The start bit fell, or halt: the axis brakes and is not referenced."""
        if self.state in (HomingState.SEARCHING, HomingState.LEAVING):
            self.state = HomingState.FAILED

    def step(self, place: float, speeds: tuple[float, float], ramp: float, offset: int, step_s: float) -> None:
        """One step. `place` is where the axis is; `speeds` are fast and slow, `offset` is 607Ch."""
        fast, slow = speeds
        velocity = 0.0
        match self.state:
            case HomingState.SEARCHING if self._method in HERE:
                self._reference.found(place, offset)
                self.state = HomingState.BRAKING
            case HomingState.SEARCHING:
                velocity = self._direction * fast
                self._search(place)
            case HomingState.LEAVING:
                velocity = -slow * self._away
                self._leave(place, offset)
        self._profile.run(velocity, ramp, step_s)
        if self.state is HomingState.BRAKING and self._profile.velocity == 0.0:
            self.state = HomingState.ATTAINED

    @property
    def _away(self) -> float:
        """Direction of the first search: the axis leaves the switch against it, whichever way it came."""
        return -1.0 if self._method in (NEGATIVE_LIMIT, HOME_FALLING) else 1.0

    @property
    def _by_home_switch(self) -> bool:
        return self._method in (HOME_RISING, HOME_FALLING)

    def _active(self, place: float) -> bool:
        switches = self._reference.switches
        if self._by_home_switch:
            return switches.home[0] <= place <= switches.home[1]
        return self._at_limit(place)

    def _at_limit(self, place: float) -> bool:
        switches = self._reference.switches
        return place <= switches.negative if self._direction < 0.0 else place >= switches.positive

    def _search(self, place: float) -> None:
        if self._active(place):
            self._seen = True
            self.state = HomingState.LEAVING
        elif self._by_home_switch and self._at_limit(place):
            if self._reversed:
                self.state = HomingState.FAILED
            self._reversed = True
            self._direction = -self._direction

    def _leave(self, place: float, offset: int) -> None:
        if self._active(place):
            self._seen = True
            return
        # It may have shot over the cam while it braked; then it comes back to it first.
        switches = self._reference.switches
        edge = self._edge()
        if self._seen and (place - edge) * self._away < 0.0:
            self._reference.found(edge, offset)
            self.state = HomingState.BRAKING
        elif self._by_home_switch and (place <= switches.negative or place >= switches.positive):
            self.state = HomingState.FAILED

    def _edge(self) -> float:
        switches = self._reference.switches
        if self._by_home_switch:
            return switches.home[0] if self._away > 0.0 else switches.home[1]
        return switches.negative if self._away < 0.0 else switches.positive
