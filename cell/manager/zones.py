"""One exclusive zone: who may be inside (grant) and who may be inside by measurement (occupancy) are two things.

FREE → GRANTED → OCCUPIED → GRANTED → FREE is the way of a holder that behaves. ORPHANED blocks the zone for everyone
until every robot that may be inside (a *suspect*) is measured outside by its own fresh body, or an operator decides
(`docs/architecture.md`, section 4.1).

A grant ends by a presence that answers a state with the grant, does not hold it, and whose body is outside. For this to
be safe an agent never takes up a token again that it did not hold in such a presence.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import inf

from cell.messages import Token, ZoneState


@dataclass(frozen=True, slots=True)
class Sight:
    """What the manager knows of a robot as far as one zone is concerned; only robots that were once fresh have one."""

    boot: str
    fresh: bool
    known: bool
    inside: bool
    """The newest body that was fresh touches the zone; an unknown body counts as the robot's whole reach."""
    moving: bool
    holds: Token | None
    wants: bool
    echo: int
    """Sequence of the manager state that the presence answers."""
    refused: str
    """Why the robot gets no grants; empty when it may."""
    still_braking: bool = False
    """Silent for so short a time that it may not have come to rest yet."""
    needed_in_s: float = inf
    """When it comes to stand where it does not get the zone; infinite where it does not want it."""


@dataclass(frozen=True, slots=True)
class Intrusion:
    """A robot came to be inside without a grant."""

    zone: str
    robot: str
    other: str | None
    """The robot that the zone belongs to, if any."""
    real: bool
    """The body is measured, and it moves or the zone belongs to another: reason for a protective stop."""
    known: bool
    """The robot knows where it is."""


class Zone:
    """The state of one zone; `look` follows the robots, `grant`, `clear` and `adopt` are decisions."""

    def __init__(self, name: str, robots: Iterable[str], awaited: Iterable[str], epoch: int) -> None:
        """`robots` may ask for the zone; nothing is granted before all `awaited` have reported."""
        self.name = name
        self.robots = frozenset(robots)
        self.state = ZoneState.FREE
        self.holder: str | None = None
        self.token: Token | None = None
        self.queue: list[str] = []
        self.awaited = set(awaited)
        self.suspects: dict[str, str] = {}
        """Robots that may be inside, and why each of them may."""
        self._epoch = epoch
        self._boot: str | None = None
        self._granted_in = 0
        self._rebuilding = True
        self._declared_out: set[str] = set()

    @property
    def reason(self) -> str:
        """Why the zone is blocked, by those who may still be inside; empty when it is not."""
        return "; ".join(dict.fromkeys(self.suspects.values()))

    # Following the robots

    def look(self, sights: Mapping[str, Sight], sequence: int) -> list[Intrusion]:
        """Follow what the robots say; `sequence` is that of the next manager state."""
        fresh = {robot for robot, sight in sights.items() if sight.fresh}
        self.awaited -= fresh
        self._declared_out -= fresh
        if self._rebuilding and not self.awaited:
            self._take_claims(sights, sequence)
        if self.state in (ZoneState.GRANTED, ZoneState.OCCUPIED):
            self._follow_holder(sights)
        intrusions = self._find_intruders(sights)
        if self.state is ZoneState.ORPHANED:
            self._follow_suspects(sights)
        self._line_up(sights)
        return intrusions

    def _claims(self, sights: Mapping[str, Sight]) -> dict[str, Token]:
        """Grants of an earlier epoch: after a restart they live on in the presences of those who hold them."""
        return {
            robot: sight.holds
            for robot, sight in sights.items()
            if sight.fresh and sight.holds is not None and sight.holds.epoch < self._epoch
        }

    def _take_claims(self, sights: Mapping[str, Sight], sequence: int) -> None:
        """Name the holder of before the restart again, once nobody can have a newer grant that was not heard yet."""
        claims = self._claims(sights)
        strangers = {robot: token for robot, token in claims.items() if robot != self.holder}
        if not strangers:
            return
        involved = claims.keys() | self.suspects.keys() | ({self.holder} if self.holder else set())
        refused = [f"{robot}: {sights[robot].refused}" for robot in claims if sights[robot].refused]
        if len(involved) == 1 and not refused:
            [(robot, token)] = claims.items()
            self._set_holder(robot, sights[robot].boot, token, sequence)
            return
        self._rebuilding = False
        if self.holder is not None and self.token is not None:
            claims[self.holder] = self.token
        # The newest grant is the valid one; its holder has the zone again when all others have let it go.
        newest = max(claims, key=claims.__getitem__)
        self.holder = self.token = self._boot = None
        if not sights[newest].refused:
            self.holder, self.token, self._boot = newest, claims[newest], sights[newest].boot
        self._orphan(
            involved, "; ".join(refused) or f"{' and '.join(sorted(involved))} both claim it since the manager started"
        )

    def _follow_holder(self, sights: Mapping[str, Sight]) -> None:
        holder = self.holder or ""
        sight = sights.get(holder)
        if sight is None or not sight.fresh:
            self._orphan({holder}, f"{holder} fell silent and may be inside")
        elif sight.boot != self._boot:
            self._orphan({holder}, f"{holder} was restarted and may be inside")
        elif sight.inside:
            self.state = ZoneState.OCCUPIED
        elif sight.holds == self.token or sight.echo < self._granted_in:
            self.state = ZoneState.GRANTED
        else:
            self._free()

    def _find_intruders(self, sights: Mapping[str, Sight]) -> list[Intrusion]:
        good = self.holder if self.state in (ZoneState.GRANTED, ZoneState.OCCUPIED) else None
        claiming = self._claims(sights) if self._rebuilding and self.awaited else {}
        excused = {good} | self._declared_out | set(claiming)
        inside = {robot for robot, sight in sights.items() if sight.inside and robot not in excused}
        found = []
        for robot in sorted(inside - self.suspects.keys()):
            sight, other = sights[robot], self.holder if self.holder != robot else None
            real = sight.fresh and sight.known and (other is not None or sight.moving)
            found.append(Intrusion(self.name, robot, other, real, sight.known))
            why = f"{robot} is inside without a grant" if sight.known else f"{robot} does not know where it is"
            self._orphan({robot} | ({other} - self.suspects.keys() if other else set()), why)
        return found

    def _follow_suspects(self, sights: Mapping[str, Sight]) -> None:
        for robot in sorted(self.suspects):
            sight = sights.get(robot)
            if sight is not None and sight.fresh and not sight.inside and self._has_let_go(robot, sight):
                del self.suspects[robot]
                if robot == self.holder:
                    self.holder = self._boot = self.token = None
        if not self.suspects:
            self._free()
            return
        sight = sights.get(self.holder or "")
        alone = self.suspects.keys() == {self.holder}
        if alone and sight is not None and sight.fresh and sight.boot == self._boot and sight.holds == self.token:
            self.state = ZoneState.OCCUPIED if sight.inside else ZoneState.GRANTED
            self.suspects.clear()

    def _has_let_go(self, robot: str, sight: Sight) -> bool:
        """The robot can not enter under the grant that it had."""
        if robot == self.holder and sight.boot == self._boot:
            return sight.holds != self.token and sight.echo >= self._granted_in
        return sight.known and sight.holds is None

    def _may_enter(self, robot: str, sight: Sight) -> bool:
        """It lives and relies on a grant, or has not heard yet of the one that it has."""
        unheard = robot == self.holder and sight.boot == self._boot and sight.echo < self._granted_in
        return sight.holds is not None or unheard

    def _line_up(self, sights: Mapping[str, Sight]) -> None:
        """Whoever stops asking or falls silent loses its place; in which order they go says `ZoneTurns`."""
        asking = {
            robot
            for robot, sight in sights.items()
            if sight.fresh and sight.wants and not sight.refused and robot in self.robots and robot != self.holder
        }
        self.queue = [robot for robot in self.queue if robot in asking]
        self.queue += sorted(asking - set(self.queue))

    # Decisions

    def open_to(self, robot: str, sight: Sight) -> bool:
        """Whether a robot may have the zone now, where it is its turn."""
        return self.state is ZoneState.FREE and not self.awaited and robot in self.queue and sight.known

    @property
    def comes_free(self) -> bool:
        """It is free, or will be once its holder leaves; nobody has to decide first."""
        return self.state is not ZoneState.ORPHANED and not self.awaited

    def grant(self, robot: str, boot: str, token: Token, sequence: int) -> None:
        """Give the zone to a robot to which it is open."""
        self.queue.remove(robot)
        self._set_holder(robot, boot, token, sequence)

    def clear(self, sights: Mapping[str, Sight], sequence: int) -> tuple[bool, str]:
        """An operator has looked: no robot is inside that does not say so itself. Done or not, and why."""
        if self.state in (ZoneState.GRANTED, ZoneState.OCCUPIED):
            return False, (
                f"zone {self.name} is held by {self.holder}, which lives and gives it up once it is outside: "
                f"`cell continue {self.holder}`, `cell run {self.holder}` or `cell jog {self.holder}` leads it out"
            )
        braking = sorted(robot for robot in self.suspects if robot in sights and sights[robot].still_braking)
        if braking:
            return False, (
                f"zone {self.name}: {', '.join(braking)} fell silent a moment ago and may still be moving; look when "
                f"it stands, then `cell zone clear {self.name}` again"
            )
        alive = {robot: sights[robot] for robot in self.suspects if robot in sights and sights[robot].fresh}
        inside = {robot for robot, sight in alive.items() if sight.inside}
        entitled = {robot for robot, sight in alive.items() if not sight.inside and self._may_enter(robot, sight)}
        self._declared_out |= (self.suspects.keys() | self.awaited) - inside - entitled
        self.suspects = {robot: f"{robot} is measured inside" for robot in sorted(inside)}
        awaited = ", ".join(sorted(self.awaited))
        self.awaited.clear()
        if awaited and self._rebuilding and self.state is ZoneState.FREE:
            self._take_claims(sights, sequence)
            return True, f"zone {self.name} waits for {awaited} no more"
        self._rebuilding = False
        self.suspects |= {robot: f"{robot} lives and has its grant still" for robot in sorted(entitled)}
        if entitled and not inside:
            return True, f"zone {self.name} is left to {', '.join(sorted(entitled))}, which lives and may come in"
        if inside:
            names = ", ".join(sorted(inside))
            adopt = " or ".join(f"`cell zone adopt {self.name} {robot}`" for robot in sorted(inside))
            return False, f"zone {self.name}: {names} is measured inside; move it out, or {adopt}"
        self._free()
        return True, f"zone {self.name} is free"

    def adopt(
        self, robot: str, sights: Mapping[str, Sight], new_token: Callable[[], Token], sequence: int
    ) -> tuple[bool, str]:
        """An operator gives an orphaned zone to the one robot that may be inside. Done or not, and why."""
        sight = sights.get(robot)
        if self.state is not ZoneState.ORPHANED:
            found = f"{self.state.value} by {self.holder}" if self.holder else self.state.value
            return False, f"zone {self.name} is {found}, only an orphaned zone can be adopted; nothing needs to be done"
        if self.suspects.keys() != {robot}:
            found = f"{', '.join(sorted(self.suspects))} may be inside, not {robot} alone"
            clear = f"`cell zone clear {self.name}`, then once more `cell zone adopt {self.name} {robot}`"
            return (
                False,
                f"zone {self.name}: {found}; if the others are silent and you see them outside: {clear}",
            )
        if robot not in self.robots:
            return False, f"zone {self.name} is closed for {robot}; allowed: {', '.join(sorted(self.robots))}"
        if sight is None or not sight.fresh:
            return False, f"{robot} is silent; start its agent first: `cell status` says how"
        if not sight.known:
            return False, f"{robot} does not know where it is; let it find out first: `cell drives` says how"
        self._set_holder(robot, sight.boot, new_token(), sequence)
        return True, f"zone {self.name} is granted to {robot} with token {self.token}"

    # Changes of state

    def _set_holder(self, robot: str, boot: str, token: Token, sequence: int) -> None:
        self.state = ZoneState.GRANTED
        self.holder, self._boot, self.token = robot, boot, token
        self._granted_in = sequence
        self._rebuilding = self._rebuilding and token.epoch < self._epoch
        self.suspects.clear()

    def _orphan(self, suspects: set[str], reason: str) -> None:
        self.state = ZoneState.ORPHANED
        for robot in sorted(suspects):
            self.suspects[robot] = reason

    def _free(self) -> None:
        self.state = ZoneState.FREE
        self.holder = self._boot = self.token = None
        self.suspects.clear()
