"""What simulated drives carry: from the masses of the robots' files to the loads on their shafts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cell.commands.errors import CommandError
from cell.config.settings import CellSettings

if TYPE_CHECKING:
    from drive_gateway.config import GatewaySettings
    from drive_gateway.sim.axis.robot_load import RobotTorques


def robot_loads(cell: CellSettings, drives: GatewaySettings) -> dict[str, RobotTorques]:
    """By robot of a gateway; empty unless its drives file says that they carry whole robots (`masses: robot`).

    Raises:
        CommandError: a robot has no masses.
        cell.config.ConfigError: its file has problems.
    """
    if not drives.simulation.whole_robots:
        return {}
    from robot_agent.dynamics import axis_torques
    from robot_agent.workspace import PlacedRobot

    loads: dict[str, RobotTorques] = {}
    for name in drives.robots:
        settings = cell.robots[name]
        robot = PlacedRobot.of(settings)
        torques = axis_torques(robot.model, robot.pose_world_base)
        if torques is None or not torques.knows_links:
            raise CommandError(f"{settings.model} has no masses for the drives of {name} to carry", "set masses: axes")
        loads[name] = torques.of_links
    return loads
