"""How a drive stops (CiA 402): quick stop 605Ah, shutdown 605Bh, disable operation 605Ch, halt 605Dh, fault 605Eh."""

from drive_gateway.sim.drives.power_state import DriveState
from drive_gateway.sim.drives.user_units import UserUnits
from drive_gateway.sim.services.abort import Abort, AccessRefused
from drive_gateway.sim.services.dictionary import key_of
from drive_gateway.sim.services.objects import AxisObjects

_QUICK_STOP, _FAULT_REACTION, _HALT = key_of(0x605A), key_of(0x605E), key_of(0x605D)
_SHUTDOWN, _DISABLE_OPERATION = key_of(0x605B), key_of(0x605C)
_PROFILE_DECELERATION, _QUICK_STOP_DECELERATION = key_of(0x6084), key_of(0x6085)
_AT_ONCE, _SLOW_DOWN, _QUICK = 0, 1, 2
_STAY = 4
"""Quick stop: option 5 brakes as 1 does, 6 as 2 and 7 as 3, and the drive stays in Quick Stop Active."""
_NO_QUICK_STOP = 4
"""The only number up to 7 that means nothing."""
_LEAVING = {DriveState.SWITCHED_ON: _DISABLE_OPERATION, DriveState.READY_TO_SWITCH_ON: _SHUTDOWN}


class OptionCodes:
    """The option codes of one axis. Decelerations are in counts/s^2."""

    def __init__(self, objects: AxisObjects, units: UserUnits, hardest: float) -> None:
        """`hardest`: deceleration at the current limit."""
        self._numbers = objects.numbers
        self._units = units
        self._hardest = hardest
        objects.guards[_QUICK_STOP] = _known

    def voltage_off_at_once(self, state: DriveState) -> bool:
        """The reaction that `state` is for does not brake: the axis runs into its holding brake."""
        if state is DriveState.QUICK_STOP_ACTIVE:
            return self._numbers[_QUICK_STOP] == _AT_ONCE
        return state is DriveState.FAULT_REACTION_ACTIVE and self._numbers[_FAULT_REACTION] == _AT_ONCE

    def brakes_before(self, state: DriveState, target: DriveState) -> bool:
        """A drive that is enabled and told to go to `target` slows down first (605Bh and 605Ch)."""
        enabled = state is DriveState.OPERATION_ENABLED
        return enabled and target in _LEAVING and self._numbers[_LEAVING[target]] == _SLOW_DOWN

    def stays_in_quick_stop(self) -> bool:
        return self._numbers[_QUICK_STOP] > _STAY

    def deceleration(self, state: DriveState) -> float:
        """Of the reaction that `state` is for; of an enabled drive that is told to leave its state."""
        if state is DriveState.QUICK_STOP_ACTIVE:
            return self._of(self._numbers[_QUICK_STOP] % _STAY)
        return self._of(self._numbers[_FAULT_REACTION] if state is DriveState.FAULT_REACTION_ACTIVE else _SLOW_DOWN)

    def halt_deceleration(self) -> float:
        return self._of(self._numbers[_HALT])

    def _of(self, option: int) -> float:
        if option == _SLOW_DOWN:
            return self._units.acceleration * self._numbers[_PROFILE_DECELERATION]
        if option == _QUICK:
            return self._units.acceleration * self._numbers[_QUICK_STOP_DECELERATION]
        return self._hardest


def _known(option: int) -> None:
    """A guard: 0 to 7 is what the EDS lets through."""
    if option == _NO_QUICK_STOP:
        raise AccessRefused(Abort.RANGE)
