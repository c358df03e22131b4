"""Objects that a CiA 402 drive or a CiA 401 I/O node may lack, and what a cell loses without them."""

from drive_gateway.canopen.drive_objects import (
    ABORT_CONNECTION_OPTION,
    FOLLOWING_TIME,
    FOLLOWING_WINDOW,
    INTERPOLATION_PERIOD,
    QUICK_STOP_OPTION,
)

OPTIONAL_OBJECTS: dict[int, tuple[str, str]] = {
    0x1016: (
        "heartbeat of the gateway",
        "it does not notice a gateway that is gone; only missing set points stop it, if it watches them (objects)",
    ),
    ABORT_CONNECTION_OPTION: (
        "reaction to a lost connection",
        "whether it stops when gateway or bus are gone is its own setting, which nobody checks here",
    ),
    QUICK_STOP_OPTION: (
        "quick-stop option",
        "how it ends a quick stop is its own setting: it may take its torque off before the brake holds",
    ),
    FOLLOWING_WINDOW: ("following-error window", "only the gateway notices a following error, not the drive itself"),
    FOLLOWING_TIME: ("following-error time", "how long the drive bears a following error is its own setting"),
    INTERPOLATION_PERIOD: (
        "interpolation period",
        "it must be set to the cycle of this bus by other means, or it moves in steps or too fast",
    ),
}
"""By index, as axis 1 has it: name, and the cost of going without."""
IO_OPTIONAL_OBJECTS: dict[int, tuple[str, str]] = {
    0x1016: (
        "heartbeat of the gateway",
        "it does not notice a gateway that is gone, so its outputs stay as they are",
    ),
    0x6206: ("error mode of the outputs", "what its outputs do when the gateway is gone is its own setting"),
    0x6207: ("error value of the outputs", "what its outputs do when the gateway is gone is its own setting"),
}
"""The same of an I/O node."""
