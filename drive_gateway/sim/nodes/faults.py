"""What shows of a simulated node's drives, and faults that a test or a demonstration asks for."""

from drive_gateway.sim.axis.axis_servo import AxisServo
from drive_gateway.sim.drives.drive import Drive
from drive_gateway.sim.drives.power_state import DriveState


class FaultsOnCommand:
    """What breaks of a node's drives when it is told to; faults of an axis are in `AxisServo`."""

    drives: tuple[Drive, ...]

    @property
    def state(self) -> DriveState:
        """Of its first axis, as all that follows."""
        return self.drives[0].state

    @property
    def position(self) -> float:
        """Where the axis is [counts]."""
        return self.drives[0].position

    @property
    def servo(self) -> AxisServo:
        """The axis, for faults on command."""
        return self.drives[0].servo

    @property
    def top_speed(self) -> float:
        """[counts/s] that the axis cannot exceed."""
        return self.drives[0].top_speed

    def set_input(self, bit: int, closed: bool, axis: int = 1) -> None:
        """A digital input of an axis' drive (60FDh) opens or closes; 16 and 17 are its enable inputs."""
        self.drives[axis - 1].input(bit, closed)

    def exchange_encoder(self, serial: int, axis: int = 1) -> None:
        """Play that the motor of an axis is replaced: another encoder answers."""
        self.drives[axis - 1].reference.serial = serial

    def empty_battery(self, axis: int = 1) -> None:
        """Play that the battery of an axis' encoder runs empty; it says so until it has homed."""
        self.drives[axis - 1].reference.battery_empty = True

    def raise_emergency(self, code: int, axis: int = 1) -> None:
        """The drive of an axis finds an error: EMCY with `code`, braking, fault. The cause is gone when it is reset."""
        self.drives[axis - 1].fault(code)
