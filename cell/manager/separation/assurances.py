"""What operators say of where robots stay that do not tell it themselves (`docs/architecture.md`, section 4.5).

A word counts until the robot says itself where it is, or an operator takes it back. One of a manager of before counts
again only where the robot is heard not to know where it is, or not heard for so long that its agent does not live: the
journal may have missed the end of that word.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from cell.geometry import Box
from cell.manager.records import Assured
from cell.manager.separation.ledger import Ledger
from cell.messages import Assurance, Confinement, ConfineRobot, Presence, RobotStands, Sections

_ANSWERABLE = "You are answerable for it; it replaces no hard-wired protection"


@dataclass(frozen=True, slots=True)
class Sighting:
    """What is heard of a robot now."""

    presence: Presence | None
    """Its newest one, if that may be relied on."""
    powered: bool | None
    """Whether its drives have torque; None: its gateway is silent."""
    in_setup: bool


@dataclass(frozen=True, slots=True)
class Ended:
    """A word that does not count any more, and why, for people."""

    robot: str
    text: str
    remedy: str = ""
    """Of one that ended although the robot does not say where it is."""


class Assurances:
    """Of one manager."""

    def __init__(self, ledger: Ledger, stored: Iterable[Assured], silent_s: float) -> None:
        """`stored` are those of a manager of before, of robots of this cell; `silent_s`: an agent of which nothing is
        heard for longer moves no robot."""
        self._ledger = ledger
        self._stored = {each.robot: each for each in stored}
        self._silent_s = silent_s
        self._started: float | None = None
        self.present: dict[str, Assurance] = {}
        """Those that count, by robot."""

    def give(self, command: ConfineRobot | RobotStands, sighting: Sighting) -> tuple[Assured | None, str]:
        """An operator's word: what there is to store, or None, and the answer."""
        robot = command.robot
        if refusal := self._refusal(command, sighting):
            return None, refusal
        box = command.box if isinstance(command, ConfineRobot) else None
        place = self._ledger.last_place(robot) if box is None else Sections()
        word = Assured(robot, Assurance(command.by, box), place)
        self._begin(word)
        stays = f"stays in {_size(box)}" if box is not None else f"stands where it was last known: {_extent(place)}"
        text = f"{robot} {stays}. All others keep away from there until it says itself where it is. {_ANSWERABLE}"
        if box is None and sighting.powered is None:
            text += f"; its gateway is silent: see to it that {robot} has no power"
        return word, text

    def end(self, robot: str) -> bool:
        """Nothing that was said of a robot counts any more; whether anything was."""
        was = self._stored.pop(robot, None) is not None
        if self.present.pop(robot, None) is not None:
            self._ledger.end_assurance(robot)
            was = True
        return was

    def step(self, sightings: Mapping[str, Sighting], now: float) -> list[Ended]:
        """Take up what was stored, where it counts; the words that have ended."""
        self._started = now if self._started is None else self._started
        ended = []
        for robot in [*self._stored, *self.present]:
            sighting = sightings[robot]
            if over := self._over(robot, sighting):
                self.end(robot)
                ended.append(over)
            elif robot in self._stored and (_is_lost(sighting) or now - self._started > self._silent_s):
                self._begin(self._stored.pop(robot))
        for robot, sighting in sightings.items():
            if sighting.in_setup:
                self._ledger.moved_unseen(robot)
        return ended

    def _begin(self, word: Assured) -> None:
        self._stored.pop(word.robot, None)
        self.present[word.robot] = word.assurance
        if word.assurance.box is None:
            self._ledger.stand(word.robot, word.place)
        else:
            self._ledger.confine(word.robot, _box(word.assurance.box))

    def _over(self, robot: str, sighting: Sighting) -> Ended | None:
        if sighting.presence is not None and sighting.presence.body.known:
            return Ended(robot, f"{robot} says itself where it is: what was said of it counts no more")
        word = self.present.get(robot)
        if word is not None and word.box is None and (sighting.powered or sighting.in_setup):
            text = f"{robot} can move: it does not count any more that it stands where it was last known"
            return Ended(robot, text, f"home it, or say where it stays: `cell confine {robot}`")
        return None

    def _refusal(self, command: ConfineRobot | RobotStands, sighting: Sighting) -> str:
        robot = command.robot
        if sighting.presence is not None and sighting.presence.body.known:
            return f"{robot} says itself where it is, and others keep away from there: nothing is to be said of it"
        if isinstance(command, ConfineRobot):
            return ""
        if sighting.powered and sighting.presence is None:
            return f"the drives of {robot} are on: start its agent and disable it, or take its power, then say it again"
        if sighting.powered or sighting.in_setup:
            return f"the drives of {robot} are on: `cell disable {robot}`, then say it again"
        if not len(self._ledger.last_place(robot)):
            return f"this manager does not know where {robot} was: say in which box it stays: `cell confine {robot}`"
        return ""


def _is_lost(sighting: Sighting) -> bool:
    return sighting.presence is not None and not sighting.presence.body.known


def _box(box: Confinement) -> Box:
    return Box.at(box.size_m, box.position_m, box.quaternion_xyzw)


def _size(box: Confinement) -> str:
    size = " x ".join(f"{1000.0 * each:.0f}" for each in box.size_m)
    x, y, z = (f"{1000.0 * each:.0f}" for each in box.position_m)
    return f"the box of {size} mm about X {x} Y {y} Z {z} mm"


def _extent(place: Sections) -> str:
    """How far something reaches along the axes of world, for people."""
    radii = place.radii[:, :, None, None]
    low = (place.points - radii).min(axis=(0, 1, 2))
    high = (place.points + radii).max(axis=(0, 1, 2))
    ends = np.round(1000.0 * np.stack([low, high]), 0) + 0.0
    return ", ".join(f"{axis} {a:.0f} to {b:.0f}" for axis, a, b in zip("XYZ", *ends, strict=True)) + " mm"
