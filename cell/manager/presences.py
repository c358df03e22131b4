"""What the manager knows of each robot, and which of it is fresh."""

from dataclasses import dataclass, field

from cell.manager.occupancy import ZoneSpace
from cell.manager.zones import Sight
from cell.messages import Body, Heard, Presence, TokenGone
from cell.net.freshness import NewestOf, Sent


@dataclass(slots=True)
class _Robot:
    newest: NewestOf = field(default_factory=NewestOf)
    presence: Presence | None = None
    body: Body | None = None
    """The last body that was fresh: where the robot is until a fresh one says otherwise."""
    gone: bool = False


class Presences:
    """Presences by robot. One is fresh while it answers a manager state that was sent less than `fresh_s` ago."""

    def __init__(self, boot: str, digest: str, robots: frozenset[str], fresh_s: float) -> None:
        self._digest = digest
        self._configured = robots
        self._fresh_s = fresh_s
        self._sent = Sent(boot)
        self._robots: dict[str, _Robot] = {}

    def sent_state(self, sequence: int, now: float) -> None:
        """A manager state was sent."""
        self._sent.record(sequence, now)

    def forget_echoes(self) -> None:
        """After an own freeze: no presence is fresh until it answers a new state."""
        self._sent.forget()

    def hear(self, presence: Presence) -> None:
        """Take a presence, unless it is old or of a boot that was replaced."""
        robot = self._robots.setdefault(presence.robot, _Robot())
        if robot.newest.accept(presence.boot, presence.sequence):
            robot.presence = presence
            robot.gone = False

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
        return self.age(robot.presence.heard, now) < self._fresh_s

    def age(self, heard: Heard | None, now: float) -> float:
        """Age [s] of what answers a manager state; infinite when it proves nothing."""
        return self._sent.age(heard, now)

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
            )
        return seen

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
