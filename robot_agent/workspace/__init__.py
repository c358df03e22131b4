"""Where in the world a robot stands and moves: its base, swept bodies, their published form, zones that they cross,
things that they must not touch, spaces that they keep to.

In go a model, its base and surroundings from the cell file, and joints along a motion; out come bodies and sections as
they are published, crossings of zones, touches and breaches of spaces. It must not know programs, the agent or the
manager: who has which zone or section is not said here.
"""

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
from robot_agent.workspace.cover import Cover
from robot_agent.workspace.itself import Itself, named, owned_by, part_of
from robot_agent.workspace.placed_robot import PlacedRobot, with_tool
from robot_agent.workspace.sections import (
    BACKING_RATE,
    FOLLOWING_M,
    ROOM_M,
    MotionSections,
    cut,
    extended,
    of_points,
    sections_of,
    standing,
)
from robot_agent.workspace.spaces import Breach, Spaces
from robot_agent.workspace.swept_body import Sweep, sweep
from robot_agent.workspace.things import Things, Touch, solid_of, unknown_links
from robot_agent.workspace.zones import Crossing, crossings, with_entry

__all__ = [
    "BACKING_RATE",
    "BODY_GROWTH_M",
    "BRAKING_RESERVE",
    "FOLLOWING_M",
    "ROOM_M",
    "Braking",
    "Breach",
    "Cover",
    "Crossing",
    "Envelope",
    "Itself",
    "MotionSections",
    "PlacedRobot",
    "Spaces",
    "Sweep",
    "Things",
    "Touch",
    "body_message",
    "crossings",
    "cut",
    "envelope",
    "extended",
    "joined",
    "named",
    "of_points",
    "owned_by",
    "part_of",
    "sections_of",
    "solid_of",
    "standing",
    "standing_body",
    "sweep",
    "unknown_body",
    "unknown_links",
    "with_entry",
    "with_tool",
]
