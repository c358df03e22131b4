"""What is written to an I/O node: what its outputs do without a master, and what they are at the start."""

from drive_gateway.canopen.io_map import DIGITAL_OUTPUTS, ERROR_MODE, ERROR_VALUE
from drive_gateway.cia402.preparation import Preparation, same, waived
from drive_gateway.config.settings import IoSettings


def error_behaviour(io: IoSettings) -> list[Preparation]:
    """Without its master an output goes off, unless the drives file says that it is kept (CiA 401, 6206h and 6207h)."""
    subs = range(1, io.output_bytes + 1)
    modes = [same("error mode of the outputs", ERROR_MODE, sub, ~_byte(io.kept, sub) & 0xFF, 1) for sub in subs]
    values = [same("error value of the outputs", ERROR_VALUE, sub, 0, 1) for sub in subs]
    return waived(io, [*values, *modes])


def io_outputs(io: IoSettings, on: int) -> list[Preparation]:
    """The outputs as they are to be when the node starts."""
    return [same("digital outputs", DIGITAL_OUTPUTS, sub, _byte(on, sub), 1) for sub in range(1, io.output_bytes + 1)]


def _byte(word: int, sub: int) -> int:
    return word >> 8 * (sub - 1) & 0xFF
