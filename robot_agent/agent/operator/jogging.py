"""An operator's jog key: from the call that begins a press, through its signs of life, to rest."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cell.messages import Go, Heard, Jog, JogHeld, Sections
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.space.jog_tube import JogTube
from robot_agent.agent.space.shared_space import SharedSpace
from robot_agent.agent.zones.zone_claims import ZoneClaims
from robot_agent.agent.zones.zone_guard import ZoneGuard
from robot_agent.trajectory.sources import Axes, JogSource, JogWish, WayAxes

TOOL_AXES = ("X", "Y", "Z", "A", "B", "C")
HELD_S = 0.2
"""A press ends when its newest sign of life is older (`docs/architecture.md`, section 6)."""


class Jogging:
    """The present press, if there is one. A press that has ended, for whatever reason, is never taken again."""

    def __init__(self, robot: str, zones: ZoneClaims, space: SharedSpace) -> None:
        self._robot = robot
        self._guard = ZoneGuard(zones, space)
        self._tube = JogTube()
        self._press = ""
        self._spent: set[str] = set()
        self._message: JogHeld | None = None
        self._alive_at = -math.inf
        self.source: JogSource | None = None
        """What moves the robot; it stays until the robot is at rest after the press."""
        self.ended_by = ""
        """Why the last press ended, when the operator did not let the key go."""

    @property
    def held(self) -> bool:
        return self.source is not None and self.source.held

    def why_not(self, command: Jog | Go, planner: Planner) -> str:
        """Why a press cannot begin, for people; empty when it can."""
        if command.press in self._spent:
            return "this press of the key has ended: let the key go and press it again"
        if self.held and command.press != self._press:
            return f"{self._robot} is being jogged by another key"
        if isinstance(command, Go):
            return ""
        names = (*planner.model.joint_names, *TOOL_AXES)
        if command.axis not in names:
            return f"no axis {command.axis!r}; allowed are {', '.join(names)}"
        if not (math.isfinite(command.speed) and command.speed != 0.0):
            return f"speed {command.speed:g} found, allowed is any but 0"
        if command.step is not None and not 0.0 < command.step < math.inf:
            return f"step {command.step:g} found, allowed is any above 0"
        if command.step is not None and command.axis in TOOL_AXES[3:] and command.step > math.pi / 2.0:
            return f"step of {math.degrees(command.step):g} deg found, for turns of the tool at most 90 are allowed"
        return ""

    def begin(self, command: Jog | Go, planner: Planner, made_at: float, axes: Axes) -> None:
        """Begin a press that nothing speaks against, along these axes; the call is no older than `made_at`."""
        if command.press == self._press:
            return
        self._press, self._alive_at, self.ended_by = command.press, made_at, ""
        self._guard.forget()
        model, limits, names = planner.model, planner.limits, planner.model.joint_names
        if isinstance(axes, WayAxes):
            wish = JogWish(0, axes.speed, axes.length)
        elif isinstance(command, Jog):
            index = (names if command.axis in names else TOOL_AXES).index(command.axis)
            wish = JogWish(index, command.speed, command.step)
        clear = self._guard.clear_for(planner)
        self.source = JogSource(model, limits, planner.cycle_s, axes, wish, clear)

    def heard(self, message: JogHeld) -> None:
        """Take a sign of life; `follow` judges how old it is."""
        self._message = message

    def follow(self, now: float, age_of: Callable[[Heard, float], float]) -> None:
        """Note signs of life, and end the press when they stop or when its step is done."""
        self._guard.at(now)
        message, self._message = self._message, None
        if not self.held or self.source is None:
            return
        if message is not None and message.press == self._press:
            self._alive_at = max(self._alive_at, now - age_of(message.heard, now))
            if not message.held:
                self.end("")
        if self.source.arrived:
            self.end("")
        elif now - self._alive_at >= HELD_S:
            self.end(f"no sign of the jog key for {now - self._alive_at:.2f} s")

    def end(self, why: str) -> None:
        """The press has ended: the robot comes to rest."""
        if self.source is not None and self.source.held:
            self.source.held = False
            self._spent.add(self._press)
            self.ended_by = why

    def rested(self) -> None:
        """The robot is at rest after the press."""
        self.source = None

    def ahead(self, planner: Planner, q: NDArray[np.float64], at_rest: bool) -> Sections | None:
        """The space in front of the robot, which comes to rest at `q` `(n,)`; None when the press has ended."""
        return self._tube.ahead(planner, self.source, q, at_rest) if self.source is not None and self.held else None

    @property
    def wants(self) -> dict[str, float]:
        """The zones in front of the robot: seconds until they are entered, which is 0."""
        return self._guard.wants if self.held else {}
