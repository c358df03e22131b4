"""Objects that the gateway writes itself: a drives file says them by its keys, nobody writes them beside it."""

from drive_gateway.canopen.axis_objects import first_axis_index
from drive_gateway.canopen.drive_objects import (
    ABORT_CONNECTION_OPTION,
    CONTROLWORD,
    FOLLOWING_TIME,
    FOLLOWING_WINDOW,
    HOME_OFFSET,
    HOMING_ACCELERATION,
    HOMING_METHOD,
    HOMING_SPEEDS,
    INTERPOLATION_DATA,
    INTERPOLATION_PERIOD,
    INTERPOLATION_SUB_MODE,
    MODE,
    MOTOR_SPEED,
    POSITION_LIMITS,
    POSITION_RANGE,
    POSITION_WINDOW,
    POSITION_WINDOW_TIME,
    PROFILE_ACCELERATION,
    PROFILE_DECELERATION,
    PROFILE_SPEED,
    QUICK_STOP_DECELERATION,
    QUICK_STOP_OPTION,
    TARGET_POSITION,
    TARGET_TORQUE,
    TARGET_VELOCITY,
    TORQUE_OFFSET,
    VELOCITY_OFFSET,
)

_PDO_AND_SDO = (range(0x1200, 0x1300), range(0x1400, 0x1C00))
_IDENTIFIER = "nothing: the gateway uses the identifiers of CiA 301"
_HEARTBEAT = "heartbeat_producer_s, heartbeat_timeout_s and error_control"
_SETPOINT = "nothing: it is commanded in each cycle"
_MOTION = "nothing: the gateway writes it before each motion of the drive's own"
CYCLE_PERIOD = 0x1006
"""Communication cycle period: the gateway writes `cycle_s` where the drive has it, unless the drives file names it."""
_WRITTEN: dict[int, str] = {
    0x1005: _IDENTIFIER,
    CYCLE_PERIOD: "cycle_s",
    0x100C: _HEARTBEAT,
    0x100D: _HEARTBEAT,
    0x1010: "nothing: it is a command, `drive-gateway store`",
    0x1011: "nothing: it is a command",
    0x1014: _IDENTIFIER,
    0x1016: _HEARTBEAT,
    0x1017: _HEARTBEAT,
    0x1019: "sync_counter",
    ABORT_CONNECTION_OPTION: "connection_lost",
    CONTROLWORD: _SETPOINT,
    QUICK_STOP_OPTION: "quick_stop_option",
    MODE: "mode",
    FOLLOWING_WINDOW: "following_window",
    FOLLOWING_TIME: "following_time_s",
    POSITION_WINDOW: _MOTION,
    POSITION_WINDOW_TIME: _MOTION,
    TARGET_TORQUE: _SETPOINT,
    TARGET_POSITION: _SETPOINT,
    POSITION_RANGE: "endless",
    HOME_OFFSET: "homing.position",
    POSITION_LIMITS: "limits",
    MOTOR_SPEED: "speed and rated_torque_nm",
    PROFILE_SPEED: _MOTION,
    PROFILE_ACCELERATION: _MOTION,
    PROFILE_DECELERATION: _MOTION,
    QUICK_STOP_DECELERATION: "quick_stop",
    HOMING_METHOD: "homing.method",
    HOMING_SPEEDS: "homing.fast and homing.slow",
    HOMING_ACCELERATION: "homing.acceleration",
    VELOCITY_OFFSET: _SETPOINT,
    TORQUE_OFFSET: _SETPOINT,
    INTERPOLATION_SUB_MODE: "mode and interpolation",
    INTERPOLATION_DATA: _SETPOINT,
    INTERPOLATION_PERIOD: "cycle_s",
    TARGET_VELOCITY: _SETPOINT,
}


def said_by(index: int, sub: int) -> str | None:
    """The key of the drives file that says this object, of any axis; `None`: it is not the gateway's."""
    if first_axis_index(index) == INTERPOLATION_DATA and sub > 1:
        return None
    if any(index in taken for taken in _PDO_AND_SDO):
        return "pdos and profile_pdos, and otherwise nothing: PDOs and SDO channels are the gateway's"
    return _WRITTEN.get(first_axis_index(index))
