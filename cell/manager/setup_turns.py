"""Set-up by motions of the drives' own: one robot of the cell at a time, all others at rest and switched off meanwhile.

A gateway says which of its robots are to be set up. One is let in when all others stand, so no program is halted by it;
from then on every agent that hears it takes no order that moves, and confirms. It is over when its gateway says so.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from cell.config.settings import RobotSettings, Times
from cell.messages import GatewayState, Heard, Presence, SetupStatus, Severity
from cell.net.freshness import NewestOf

Age = Callable[[Heard | None], float]
"""Of what answers a manager state [s]."""


@dataclass(slots=True)
class _Gateway:
    newest: NewestOf = field(default_factory=NewestOf)
    state: GatewayState | None = None


@dataclass(frozen=True, slots=True)
class SetupNews:
    """For people."""

    severity: Severity
    code: str
    text: str
    remedy: str = ""


class SetupTurns:
    """Who is in set-up, who waits for it, and why.

    A robot that is silent counts as at rest after `silent_s` (`Times.moves_alone_s`).

    Args:
        robots: of the cell.
        boot: of this manager.
        times: the cell's deadlines.
    """

    def __init__(self, robots: Mapping[str, RobotSettings], boot: str, times: Times) -> None:
        self._gateway_of = {name: robot.gateway for name, robot in robots.items()}
        self._boot = boot
        self._fresh_s = times.fresh_s
        self.silent_s = times.moves_alone_s
        self._gateways = {name: _Gateway() for name in sorted(set(self._gateway_of.values()))}
        self._heard_at: dict[str, float] = {}
        self._started: float | None = None
        self._queue: list[str] = []
        self._announced_in = 0
        self._confirmed: set[str] = set()
        self.status: SetupStatus | None = None
        self.refused: dict[str, str] = {}
        """Robots that wait: why."""

    # Messages

    def heard_gateway(self, state: GatewayState) -> None:
        """Take a state, unless it is old, of an earlier run, or of no gateway of this cell."""
        gateway = self._gateways.get(state.gateway)
        if gateway is not None and gateway.newest.accept(state.boot, state.era, state.sequence):
            gateway.state = state

    def heard_robot(self, presence: Presence, now: float) -> None:
        """A presence of a robot of this cell came: it is not silent, whatever it says."""
        if presence.robot in self._gateway_of:
            self._heard_at[presence.robot] = now

    def heard(self) -> dict[str, Heard]:
        """The echo for the next manager state."""
        states = {name: gateway.state for name, gateway in self._gateways.items()}
        return {name: Heard(state.boot, state.sequence) for name, state in states.items() if state is not None}

    def clear(self, robot: str, age: Age) -> tuple[bool, str]:
        """An operator's word that a robot in set-up stands, because its gateway is silent. Done or not, and why."""
        if self.status is None or self.status.robot != robot:
            return False, f"{robot} is not in set-up"
        if self._alive(robot, age):
            return False, f"gateway {self._gateway_of[robot]} is alive and has {robot} in set-up: let go of its motion"
        self._gateways[self._gateway_of[robot]].state = None
        self.status = None
        return True, f"{robot} is not in set-up any more"

    # The cycle

    def step(self, fresh: Mapping[str, Presence], stopped: str, age: Age, sequence: int, now: float) -> list[SetupNews]:
        """Decide for the manager state with `sequence`; `fresh` are the presences that may be relied on.

        `stopped`: why nothing may begin or go on in the whole cell, for people; empty when it may.
        """
        self._started = now if self._started is None else self._started
        self._line_up()
        news: list[SetupNews] = []
        before = self.status
        if before is not None and self._over(before.robot):
            self.status = None
            news.append(SetupNews(Severity.INFO, "setup_over", f"{before.robot} is not in set-up any more"))
        if self.status is None:
            self.refused = {robot: self._hindrance(robot, fresh, stopped, age, now) for robot in self._queue}
            chosen = next((robot for robot in self._queue if not self.refused[robot]), None)
            if chosen is not None:
                self._announced_in = sequence
                self._confirmed = set()
                self.status = SetupStatus(chosen, False)
                text = f"{chosen} is in set-up; all other robots stay at rest"
                news.append(SetupNews(Severity.INFO, "setup_begins", text))
        if self.status is not None:
            news += self._follow(self.status, fresh, stopped, age, now)
        return news

    def _follow(
        self, status: SetupStatus, fresh: Mapping[str, Presence], stopped: str, age: Age, now: float
    ) -> list[SetupNews]:
        """Whether it is free now; the others that are to be set up wait for it."""
        robot = status.robot
        alive = self._alive(robot, age)
        reason = "" if alive else self._silent(robot)
        reason = reason or self._not_confirmed(robot, fresh, now) or stopped
        self.status = SetupStatus(robot, not reason, reason)
        self.refused = {other: f"{robot} is in set-up; one robot at a time" for other in self._queue if other != robot}
        if alive or status.reason == reason:
            return []
        return [SetupNews(Severity.WARNING, "setup_silent", f"{robot} is in set-up, and {reason}")]

    def _line_up(self) -> None:
        """First come, first served."""
        wanted = [
            robot
            for name, gateway in self._gateways.items()
            for robot in (() if gateway.state is None else gateway.state.setup)
            if self._gateway_of.get(robot) == name
        ]
        self._queue = [robot for robot in self._queue if robot in wanted]
        self._queue += [robot for robot in dict.fromkeys(wanted) if robot not in self._queue]

    def _over(self, robot: str) -> bool:
        """Its gateway says so in view of a state that had it in set-up."""
        state = self._gateways[self._gateway_of[robot]].state
        return state is not None and robot not in state.setup and self._answers(state.heard)

    def _answers(self, heard: Heard | None) -> bool:
        return heard is not None and heard.boot == self._boot and heard.sequence >= self._announced_in

    def _alive(self, robot: str, age: Age) -> bool:
        state = self._gateways[self._gateway_of[robot]].state
        return state is not None and age(state.heard) < self._fresh_s

    def _hindrance(self, robot: str, fresh: Mapping[str, Presence], stopped: str, age: Age, now: float) -> str:
        """Why a robot is not let in; empty when it may be."""
        if not self._alive(robot, age):
            return f"its gateway {self._gateway_of[robot]} is not heard anew"
        others = (self._unstill(other, fresh, now) for other in self._gateway_of if other != robot)
        return stopped or "; ".join(filter(None, others))

    def _unstill(self, other: str, fresh: Mapping[str, Presence], now: float) -> str:
        """Why another robot may move; empty when it stands."""
        presence = fresh.get(other)
        if presence is not None:
            return "" if presence.standing else f"{other} is not at rest and switched off: cell disable {other}"
        if self._has_torque(other):
            return f"{other} is switched on and its agent silent: start its agent, then cell disable {other}"
        heard_at = self._heard_at.get(other, self._started)
        if heard_at is not None and now - heard_at > self.silent_s:
            return ""
        return f"{other} is silent; it counts as at rest after {self.silent_s:.3g} s"

    def powered(self, robot: str, age: Age) -> bool | None:
        """Whether the drives of a robot have torque; None: its gateway is silent."""
        return self._has_torque(robot) if self._alive(robot, age) else None

    def _has_torque(self, robot: str) -> bool:
        """By the newest word of its gateway."""
        state = self._gateways[self._gateway_of[robot]].state
        return state is not None and any(node.drive.has_torque for node in state.nodes if node.robot == robot)

    def _not_confirmed(self, robot: str, fresh: Mapping[str, Presence], now: float) -> str:
        """Which other robots do not stand, or may not know yet that they must; who has confirmed may fall silent.

        It moves again only with a state that does not have `robot` in set-up.
        """
        reasons = []
        for other in self._gateway_of:
            if other == robot:
                continue
            presence = fresh.get(other)
            knows = presence is not None and self._answers(presence.heard)
            reason = self._unstill(other, fresh, now)
            if knows and not reason:
                self._confirmed.add(other)
            elif knows:
                self._confirmed.discard(other)
            if presence is not None and not knows:
                reason = f"{other} has not confirmed yet that it stands"
            if reason and other not in self._confirmed:
                reasons.append(reason)
        return "; ".join(reasons)

    def _silent(self, robot: str) -> str:
        gateway = self._gateway_of[robot]
        return f"its gateway {gateway} is silent: start it again, or look at {robot} and say: cell setup clear {robot}"
