"""What a robot follows beside its program: measured by sensors, or by the encoder of a belt."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cell.config.settings import CorrectionSettings, SensorFrame
from cell.geometry.pose import compose, inverse, pose_from
from cell.messages import CellTime, ConveyorCount, Correction
from robot_agent.agent.cell_clock import CellClock
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.space.shared_space import SharedSpace
from robot_agent.agent.zones.zone_claims import ZoneClaims
from robot_agent.agent.zones.zone_guard import ZoneGuard
from robot_agent.trajectory.sources import (
    Conveyor,
    CorrectionFrame,
    CorrectionLimits,
    SensorOffset,
    Stale,
    States,
    Target,
)

_AHEAD_S = 0.05
"""A measurement that claims to come from the future by more than the clocks may differ is not believed."""
_TURNING = (0.5, 3.0, 30.0)
"""Angular speed, acceleration and jerk [rad, s] of a correction."""
_JERK_PER_ACCELERATION = 10.0
_LEVER_M = 0.5
"""What a corrected turn of the tool moves at most is about so far from its TCP; what goes farther stands."""


@dataclass(frozen=True, slots=True)
class Correcting:
    """How the next block is to be corrected."""

    limits: CorrectionLimits
    frame: CorrectionFrame
    target: Target
    """Where the correction shall be now."""
    clear: Callable[[States], str]


class Corrections:
    """All corrections of one robot as they are measured, and the one that its program follows."""

    def __init__(
        self,
        robot: str,
        settings: Mapping[str, CorrectionSettings],
        clock: CellClock,
        zones: ZoneClaims,
        space: SharedSpace,
    ) -> None:
        self._robot = robot
        self._settings = settings
        self._clock = clock
        self._guard = ZoneGuard(zones, space)
        self._sources: dict[str, SensorOffset | Conveyor] = {}
        self._refused: dict[str, str] = {}
        self._followed = ""
        self._zero: NDArray[np.float64] | None = None
        """The offset at which the path is as it was taught."""
        self._taken: dict[str, float] = {}
        """Belt: where it was when the part that was followed last had passed."""

    def place(self, pose_world_base: NDArray[np.float64]) -> None:
        """The robot's base stands at `pose_world_base` `(4, 4)`; measurements before that are not taken."""
        if not self._sources:
            self._sources = {name: _source(each, pose_world_base) for name, each in self._settings.items()}

    def heard(self, message: Correction | ConveyorCount, now: float) -> None:
        """Take a measurement."""
        for name, source in self._sources.items():
            belt = self._settings[name].conveyor
            match message, source:
                case Correction(), SensorOffset() if (message.robot, message.name) == (self._robot, name):
                    if (at := self._measured_at(name, message.at, now)) is not None:
                        source.measured(np.array([*message.offset_m, *message.turn_rad]), at)
                case ConveyorCount(), Conveyor() if belt is not None and belt.name == message.conveyor:
                    if (at := self._measured_at(name, message.at, now)) is not None:
                        source.measured(message.counts, at, message.part)

    def _measured_at(self, name: str, moment: CellTime, now: float) -> float | None:
        """A measurement's moment on the own clock [s]; None, and why, when it cannot be dated."""
        until_s = self._clock.until(moment, now)
        if until_s is None:
            self._refused[name] = "what comes is stamped by another manager's clock"
            return None
        if until_s > _AHEAD_S:
            self._refused[name] = f"what comes is stamped {until_s:.2f} s in the future"
            return None
        self._refused.pop(name, None)
        return now + until_s

    def follow(self, name: str, now: float) -> None:
        """The correction that the program follows; empty for none."""
        self._guard.at(now)
        if name != self._followed:
            self._followed = name
            self._guard.forget()
            self._zero = None

    def take_up(self, now: float) -> None:
        """The program goes on: what it follows counts from here on, on a belt with parts from the next one's place."""
        if not self._followed or self._zero is not None:
            return
        source, settings = self._sources[self._followed], self._settings[self._followed]
        try:
            target = source.target(now)
        except Stale:
            return
        if isinstance(source, SensorOffset):
            self._zero = np.zeros(6)
        elif settings.conveyor is None or not settings.conveyor.parts:
            self._zero = target.offset
        else:
            self._zero = self._take_part(source, target, settings)

    @property
    def followed(self) -> str:
        """The correction that the program follows; empty for none."""
        return self._followed

    @property
    def beside_m(self) -> float:
        """How far what the program follows may lead the robot beside its path [m]; 0 while it follows nothing."""
        if not self._followed:
            return 0.0
        settings = self._settings[self._followed]
        return settings.largest_m + _LEVER_M * settings.largest_turn_rad

    @property
    def waiting(self) -> str:
        """What is waited for before the first move can be corrected, for people; empty for nothing."""
        return f"{self._followed}: the next part" if self._followed and self._zero is None else ""

    @property
    def wants(self) -> dict[str, float]:
        """The zones that corrected samples were in front of."""
        return self._guard.wants if self._followed else {}

    def problem(self, now: float) -> str:
        """Why the robot must not go on following, for people; empty when it may."""
        if not self._followed:
            return ""
        settings = self._settings[self._followed]
        try:
            target = self._target(now)
        except Stale as error:
            refused = self._refused.get(self._followed)
            return f"correction {error}{f'; {refused}' if refused else ''}"
        if target is None:
            return ""
        away_m, turned = (float(np.linalg.norm(part)) for part in np.split(target.offset, 2))
        if away_m > settings.largest_m:
            return (
                f"correction {self._followed}: {1000.0 * away_m:.1f} mm from the path, "
                f"allowed are {1000.0 * settings.largest_m:.1f} mm"
            )
        if turned > settings.largest_turn_rad:
            return (
                f"correction {self._followed}: turned by {np.degrees(turned):.1f} deg, "
                f"allowed are {np.degrees(settings.largest_turn_rad):.1f} deg"
            )
        return ""

    def wish(self, planner: Planner, now: float) -> Correcting | None:
        """How to correct the next block, when the program follows something and `problem` says nothing against it."""
        target = self._target(now) if self._followed else None
        if target is None:
            return None
        settings = self._settings[self._followed]
        limits = CorrectionLimits(
            settings.speed_m_s,
            settings.acceleration_m_s2,
            _JERK_PER_ACCELERATION * settings.acceleration_m_s2,
            *_TURNING,
        )
        frame = CorrectionFrame.TOOL if settings.sensor is SensorFrame.TOOL else CorrectionFrame.BASE
        return Correcting(limits, frame, target, self._guard.clear_for(planner))

    def waits_for_part(self, name: str) -> bool:
        """Whether who comes to follow this waits for a part."""
        belt = self._settings[name].conveyor
        return belt is not None and belt.parts

    def _target(self, now: float) -> Target | None:
        """None while a part is waited for. Raises `Stale`."""
        target = self._sources[self._followed].target(now)
        return None if self._zero is None else Target(target.offset - self._zero, target.speed)

    def _take_part(self, belt: Conveyor, target: Target, settings: CorrectionSettings) -> NDArray[np.float64] | None:
        """The newest part, unless it was followed already or is half of what is allowed away; then None."""
        if belt.part_m is None or belt.part_m == self._taken.get(self._followed):
            return None
        zero = belt.offset_at(belt.part_m)
        if np.linalg.norm(target.offset - zero) > settings.largest_m / 2.0:
            return None
        self._taken[self._followed] = belt.part_m
        return zero


def _source(settings: CorrectionSettings, pose_world_base: NDArray[np.float64]) -> SensorOffset | Conveyor:
    belt = settings.conveyor
    if belt is None:
        return SensorOffset(settings.name, settings.settle_s, settings.fresh_s)
    pose_world_belt = pose_from(np.array(belt.pose.position_m), np.array(belt.pose.quaternion_xyzw))
    return Conveyor(
        settings.name,
        compose(inverse(pose_world_base), pose_world_belt),
        1.0 / belt.counts_per_metre,
        settings.settle_s,
        settings.fresh_s,
        belt.largest_speed_m_s,
    )
