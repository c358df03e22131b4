"""The file that describes a bus and its drives."""

from drive_gateway.config.load import load_drives
from drive_gateway.config.settings import AxisSettings, BusSettings, GatewaySettings, RobotDrives

__all__ = ["AxisSettings", "BusSettings", "GatewaySettings", "RobotDrives", "load_drives"]
