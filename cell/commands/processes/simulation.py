"""How the drives of a gateway are simulated: where they stand, and what they carry of the masses of their robots."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cell.commands.errors import CommandError
from cell.config.settings import CellSettings

if TYPE_CHECKING:
    from drive_gateway.sim.axis.robot_load import RobotTorques
    from drive_gateway.sim.config.simulation import Simulation


def simulation_of(cell: CellSettings, gateway: str) -> Simulation:
    """What the file beside a gateway's drives file says; axes of which it says nothing stand at their robot's home.

    Raises:
        cell.config.ConfigError: with every problem of both files.
    """
    from cell.commands.checks.drives import at_home
    from drive_gateway.sim.config.load import load_simulation
    from robot_agent.model.load import read_robot

    simulation = load_simulation(cell.gateways[gateway].drives)
    mine = {name: read_robot(robot.model) for name, robot in cell.robots.items() if robot.gateway == gateway}
    return at_home(simulation, {name: each.content for name, each in mine.items() if each.content is not None})


def robot_loads(cell: CellSettings, gateway: str, simulation: Simulation) -> dict[str, RobotTorques]:
    """By robot of a gateway; empty unless its drives carry whole robots (`masses: robot`).

    Raises:
        CommandError: a robot has no masses.
        cell.config.ConfigError: its file has problems.
    """
    if not simulation.whole_robots:
        return {}
    from robot_agent.dynamics import axis_torques
    from robot_agent.workspace import PlacedRobot

    loads: dict[str, RobotTorques] = {}
    for name, settings in cell.robots.items():
        if settings.gateway != gateway:
            continue
        robot = PlacedRobot.of(settings)
        torques = axis_torques(robot.model, robot.pose_world_base)
        if torques is None or not torques.knows_links:
            raise CommandError(f"{settings.model} has no masses for the drives of {name} to carry", "set masses: axes")
        loads[name] = torques.of_links
    return loads
