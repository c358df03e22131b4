"""The file that describes a bus and its drives.

In go a drives file, the EDS and DCF files that it names, and facts of known drives; out come settings in SI units with
every default filled in, or all problems with line and column. It must not know a running gateway, a bus that is open,
or the simulation, which has a file of its own.
"""

from drive_gateway.config.load import load_drives
from drive_gateway.config.settings import AxisSettings, BusSettings, GatewaySettings, RobotDrives

__all__ = ["AxisSettings", "BusSettings", "GatewaySettings", "RobotDrives", "load_drives"]
