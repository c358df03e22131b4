"""Where in the world a robot is and will be: swept bodies, their published form, and the zones that they cross."""

from robot_agent.workspace.body import BODY_GROWTH_M, Envelope, body_message, envelope, standing_body, unknown_body
from robot_agent.workspace.sweep import Sweep, sweep
from robot_agent.workspace.zones import Crossing, crossings, zone_box

__all__ = [
    "BODY_GROWTH_M",
    "Crossing",
    "Envelope",
    "Sweep",
    "body_message",
    "crossings",
    "envelope",
    "standing_body",
    "sweep",
    "unknown_body",
    "zone_box",
]
