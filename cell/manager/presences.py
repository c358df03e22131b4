"""What the manager knows of each robot, and which of it is fresh."""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf

from cell.manager.occupancy import ZoneSpace
from cell.manager.zones import Sight
from cell.messages import Body, Heard, Presence, TokenGone
from cell.net.freshness import NewestOf, Sent

MOST_STRANGERS = 8
"""Robots that are not configured and followed all the same: where they are matters, how many is bounded."""


@dataclass(slots=True)
class _Robot:
    newest: NewestOf = field(default_factory=NewestOf)
    presence: Presence | None = None
    heard_at: float = -inf
    """When that presence came [s]."""
    body: Body | None = None
    """The last body that was fresh: where the robot is until a fresh one says otherwise."""
    gone: bool = False
    lower: int | None = None
    """A claim that is lower than the newest one, and whose agent lives all the same."""


class Presences:
    """Presences by robot. One is fresh while it answers a manager state that was sent less than `fresh_s` ago."""

    def __init__(self, boot: str, digest: str, robots: frozenset[str], fresh_s: float) -> None:
        self._digest = digest
        self._configured = robots
        self._fresh_s = fresh_s
        self._sent = Sent(boot)
        self._robots: dict[str, _Robot] = {}
        self.strangers_left_out: set[str] = set()
        """Some of those that could not be followed."""

    def sent_state(self, sequence: int, now: float) -> None:
        """A manager state was sent."""
        self._sent.record(sequence, now)

    def age_of(self, heard: Heard | None, now: float) -> float:
        """Upper bound [s] of the age of what was made in view of the manager state `heard`; infinite: not known."""
        return self._sent.age(heard, now)

    def forget_echoes(self) -> None:
        """After an own freeze: no presence is fresh, and no order young, until it answers a new state."""
        self._sent.forget()

    def hear(self, presence: Presence, suspects: Callable[[str], bool], now: float) -> None:
        """Take a presence, unless it is old, of an earlier claim, or of one stranger too many.

        `suspects`: whether a robot may be inside a zone; those are never forgotten.
        """
        if presence.robot not in self._robots and not self._has_room(presence.robot, suspects, now):
            if len(self.strangers_left_out) < MOST_STRANGERS:
                self.strangers_left_out.add(presence.robot)
            return
        robot = self._robots.setdefault(presence.robot, _Robot())
        if robot.newest.accept(presence.boot, presence.owner, presence.sequence):
            robot.presence, robot.heard_at = presence, now
            robot.gone, robot.lower = False, None
        elif presence.owner < robot.newest.era and self.age_of(presence.heard, now) < self._fresh_s:
            robot.lower = presence.owner

    def _has_room(self, name: str, suspects: Callable[[str], bool], now: float) -> bool:
        """Forgets a stranger that is silent and in no zone, if that makes room."""
        strangers = [stranger for stranger in self._robots if stranger not in self._configured]
        if name in self._configured or len(strangers) < MOST_STRANGERS:
            return True
        gone = next((each for each in strangers if not self.fresh(each, now) and not suspects(each)), None)
        if gone is not None:
            del self._robots[gone]
        return gone is not None

    def token_gone(self, token: TokenGone) -> None:
        """A robot's process or its link ended: silent from now on, until a new presence comes."""
        robot = self._robots.get(token.name)
        if token.role == "robot" and robot is not None and robot.newest.boot == token.boot:
            robot.gone = True

    def update(self, now: float) -> None:
        """Keep the bodies of those who are fresh."""
        for name, robot in self._robots.items():
            if robot.presence is not None and self.fresh(name, now):
                robot.body = robot.presence.body

    def fresh(self, name: str, now: float) -> bool:
        """Whether the robot's newest presence may be relied on."""
        robot = self._robots.get(name)
        if robot is None or robot.presence is None or robot.gone:
            return False
        return self.age_of(robot.presence.heard, now) < self._fresh_s

    def fresh_ones(self, now: float) -> dict[str, Presence]:
        """The newest presence of each robot that may be relied on."""
        presences = {name: robot.presence for name, robot in self._robots.items() if self.fresh(name, now)}
        return {name: presence for name, presence in presences.items() if presence is not None}

    def heard(self) -> dict[str, Heard]:
        """The echo for the next manager state."""
        newest = {name: robot.newest for name, robot in sorted(self._robots.items())}
        return {name: Heard(n.boot, n.sequence) for name, n in newest.items() if n.boot is not None}

    def refused(self) -> dict[str, str]:
        """Robots that get no grants whatever they ask for, and why."""
        return {name: why for name, robot in sorted(self._robots.items()) if (why := self._why_not(name, robot))}

    def _why_not(self, name: str, robot: _Robot) -> str:
        if name not in self._configured:
            return f"not configured; this cell has {', '.join(sorted(self._configured))}"
        if robot.lower is not None:
            return (
                f"its claim {robot.lower} is lower than {robot.newest.era} of before: stop the older agent; if the "
                "clock of its gateway's host was set back, start the manager again"
            )
        if robot.presence is None or robot.presence.digest == self._digest:
            return ""
        return (
            f"its configuration {robot.presence.digest[:8]} is not the manager's {self._digest[:8]}; "
            "start both from the same cell file"
        )

    def sights(self, space: ZoneSpace, refused: dict[str, str], now: float) -> dict[str, Sight]:
        """Every robot that was ever fresh, as seen from one zone."""
        zone, seen = space.geometry.zone, {}
        for name, robot in self._robots.items():
            presence, body = robot.presence, robot.body
            if presence is None or body is None:
                continue
            seen[name] = Sight(
                boot=presence.boot,
                fresh=self.fresh(name, now),
                known=body.known,
                inside=space.touched_by(name, body),
                moving=presence.stop_time_s > 0.0,
                holds=presence.holds.get(zone),
                wants=zone in presence.wants,
                echo=presence.heard.sequence if presence.heard is not None else -1,
                refused=refused.get(name, ""),
                still_braking=self._still_braking(name, presence, robot.heard_at, now),
                needed_in_s=presence.wants.get(zone, inf),
            )
        return seen

    def _still_braking(self, name: str, presence: Presence, heard_at: float, now: float) -> bool:
        """A robot that is not heard any more goes on for as long as it may rely on a grant, and then brakes."""
        return not self.fresh(name, now) and now - heard_at < self._fresh_s + presence.stop_time_s

    def acknowledged(self, now: float) -> dict[str, str | None]:
        """Of every configured robot that is fresh: the emergency stop under which it stands or brakes."""
        return {
            name: robot.presence.estop_acknowledged
            for name, robot in self._robots.items()
            if name in self._configured and robot.presence is not None and self.fresh(name, now)
        }

    def silent(self, now: float) -> list[str]:
        """Configured robots that cannot be relied on now."""
        return sorted(name for name in self._configured if not self.fresh(name, now))
