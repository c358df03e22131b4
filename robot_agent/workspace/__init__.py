"""Where in the world a robot is and will be: swept bodies, their published form, and the zones that they cross."""

from robot_agent.workspace.body import (
    BODY_GROWTH_M,
    Envelope,
    body_message,
    envelope,
    joined,
    standing_body,
    unknown_body,
)
from robot_agent.workspace.braking import BRAKING_RESERVE, Braking
from robot_agent.workspace.swept_body import Sweep, sweep
from robot_agent.workspace.zones import Crossing, crossings, zone_box

__all__ = [
    "BODY_GROWTH_M",
    "BRAKING_RESERVE",
    "Braking",
    "Crossing",
    "Envelope",
    "Sweep",
    "body_message",
    "crossings",
    "envelope",
    "joined",
    "standing_body",
    "sweep",
    "unknown_body",
    "zone_box",
]
