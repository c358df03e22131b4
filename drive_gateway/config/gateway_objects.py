"""Objects that the gateway writes itself: a drives file says them by its keys, nobody writes them beside it."""

from drive_gateway.canopen.axis_objects import first_axis_index

_PDO_AND_SDO = (range(0x1200, 0x1300), range(0x1400, 0x1C00))
_IDENTIFIER = "nothing: the gateway uses the identifiers of CiA 301"
_HEARTBEAT = "heartbeat_producer_s, heartbeat_timeout_s and error_control"
_SETPOINT = "nothing: it is commanded in each cycle"
_MOTION = "nothing: the gateway writes it before each motion of the drive's own"
_INTERPOLATION_DATA = 0x60C1
"""The gateway sends its first sub-object; what others mean is the maker's."""
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
    0x6007: "connection_lost",
    0x6040: _SETPOINT,
    0x605A: "quick_stop_option",
    0x6060: "mode",
    0x6065: "following_window",
    0x6066: "following_time_s",
    0x6067: _MOTION,
    0x6068: _MOTION,
    0x6071: _SETPOINT,
    0x607A: _SETPOINT,
    0x607B: "endless",
    0x607C: "homing.position",
    0x607D: "limits",
    0x6080: "speed and rated_torque_nm",
    0x6081: _MOTION,
    0x6083: _MOTION,
    0x6084: _MOTION,
    0x6085: "quick_stop",
    0x6098: "homing.method",
    0x6099: "homing.fast and homing.slow",
    0x609A: "homing.acceleration",
    0x60B1: _SETPOINT,
    0x60B2: _SETPOINT,
    0x60C0: "mode and interpolation",
    _INTERPOLATION_DATA: _SETPOINT,
    0x60C2: "cycle_s",
    0x60FF: _SETPOINT,
}


def said_by(index: int, sub: int) -> str | None:
    """The key of the drives file that says this object, of any axis; `None`: it is not the gateway's."""
    if first_axis_index(index) == _INTERPOLATION_DATA and sub > 1:
        return None
    if any(index in taken for taken in _PDO_AND_SDO):
        return "pdos and profile_pdos, and otherwise nothing: PDOs and SDO channels are the gateway's"
    return _WRITTEN.get(first_axis_index(index))
