"""What one robot's drives are, taken together: at rest, switched off, secured. Each question has its own user."""

from collections.abc import Sequence

from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.drives.power import Power, PowerState
from drive_gateway.gateway.playout.playout import Playout
from drive_gateway.gateway.setup.setup_desk import SetupDesk
from drive_gateway.gateway.watch.watch import Watch


class Standstill:
    """Looks at a robot, and changes nothing."""

    def __init__(self, drives: Sequence[Drive], power: Power, watch: Watch, playout: Playout, setup: SetupDesk) -> None:
        self._drives = drives
        self._power = power
        self._watch = watch
        self._playout = playout
        self._setup = setup

    @property
    def at_rest(self) -> bool:
        """Nothing commands a motion, and none is measured that torque could make; after a fault none at all."""
        match self._power.state:
            case PowerState.STOPPING:
                return False
            case PowerState.OFF:
                return self._setup.motion is None and all(
                    drive.rest.standing or drive.without_torque or not drive.operational for drive in self._drives
                )
            case PowerState.FAULT:
                return self._watch.standing
        return self._playout.at_rest and self._watch.standing

    @property
    def idle(self) -> bool:
        """Switched off as far as this gateway can: nothing is commanded, nothing is waited for."""
        if self._power.state is PowerState.FAULT:
            return self._idle_nodes
        return self._power.state is PowerState.OFF and self._setup.motion is None

    @property
    def _idle_nodes(self) -> bool:
        """Every node that can be heard says that it has no torque."""
        return all(not drive.operational or drive.without_torque for drive in self._drives)

    @property
    def switched_off(self) -> bool:
        """Off or in fault, standing as far as it is measured, and no node that can be heard has torque."""
        standing = self._watch.standing or not self._watch.measured
        return self._power.state in (PowerState.OFF, PowerState.FAULT) and standing and self._idle_nodes

    @property
    def secured(self) -> bool:
        """Measured at rest and without torque, by every drive's own word."""
        return self._watch.standing and self._power.off and all(drive.operational for drive in self._drives)
