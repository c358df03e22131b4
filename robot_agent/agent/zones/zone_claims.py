"""Which zones the robot holds, wants and may be in: the agent's half of `docs/architecture.md`, section 4.1."""

from collections import deque
from collections.abc import Mapping

import numpy as np

from cell.geometry import Solid, body_touches
from cell.messages import Body, Heard, ManagerState, Token, ZoneGeometry, ZoneState
from cell.net.freshness import NewestOf, Sent
from robot_agent.agent.planning.plans import Planned
from robot_agent.agent.zones.gateway_signals import GatewaySignals
from robot_agent.agent.zones.switched_spaces import SwitchedSpaces
from robot_agent.trajectory import Hold
from robot_agent.workspace import Crossing, Sweep, crossings, with_entry

_BODIES = 2
"""So many of the newest bodies have their zones remembered: the announced one and the next are asked for again."""


class ZoneClaims:
    """Zones as this robot sees them. A manager state counts only while it echoes a young presence."""

    def __init__(self, robot: str, boot: str, fresh_s: float, inputs: Mapping[str, str] | None = None) -> None:
        """`inputs`: by space of the robot, the input that switches it off."""
        self._robot = robot
        self._fresh_s = fresh_s
        self._newest = NewestOf()
        self.sent = Sent(boot)
        """The presences."""
        self.signals = GatewaySignals(robot, self.sent)
        self.spaces = SwitchedSpaces(inputs or {}, self.signals)
        self._geometry: dict[str, ZoneGeometry] = {}
        self._solids: dict[str, Solid] = {}
        self._touched: deque[tuple[Body, frozenset[str]]] = deque(maxlen=_BODIES)
        self.state: ManagerState | None = None
        self._lower: int | None = None
        """The epoch of a manager that lives, and is of before the newest one."""
        self.holds: dict[str, Token] = {}
        self._given_up: dict[str, Token] = {}

    # Freshness

    def sent_presence(self, sequence: int, body: Body, now: float) -> None:
        """A presence with the present `holds` and this body is sent.

        It frees every zone that the state it echoes grants to this robot, that it does not hold and that its body does
        not touch. The manager may give such a zone to another as soon as it hears this, so that grant is dead from
        here on.
        """
        self.sent.record(sequence, now)
        for name, status in self.state.zones.items() if self.state is not None else ():
            if status.holder != self._robot or status.token is None or name in self.holds:
                continue
            if name not in self.touched(body):
                self._given_up[name] = status.token

    def forget_echoes(self) -> None:
        """After a freeze: nothing that answers an older presence counts as young."""
        self.sent.forget()

    def heard_state(self, state: ManagerState, now: float) -> None:
        """Take a manager's state, unless it is old or of an earlier epoch."""
        self.signals.heard_manager(state)
        if self._newest.accept(state.boot, state.epoch, state.sequence):
            self.state, self._lower = state, None
        elif state.epoch < self._newest.era and self.sent.age(state.heard.get(self._robot), now) < self._fresh_s:
            self._lower = state.epoch

    def heard_geometry(self, zone: ZoneGeometry) -> None:
        """Take a zone's geometry, unless it is unknown, or the one in force is known and this is another."""
        if self.state is None or zone.zone not in self.state.zones:
            return
        known = self._geometry.get(zone.zone)
        if known is not None and known.version == self.state.zones[zone.zone].version != zone.version:
            return
        if zone != known:
            self._geometry[zone.zone], self._solids[zone.zone] = zone, zone.solid()
            self._touched.clear()

    @property
    def heard(self) -> Heard | None:
        """The echo for the next presence."""
        return None if self.state is None else Heard(self.state.boot, self.state.sequence)

    def age(self, now: float) -> float:
        """Age by echo [s] of the newest manager state."""
        return self.sent.age(self.state.heard.get(self._robot) if self.state is not None else None, now)

    def fresh(self, now: float) -> bool:
        return self.age(now) < self._fresh_s

    # Set-up and changes of zones

    @property
    def kept_still(self) -> str:
        """Why nothing may move this robot now; empty when it may.

        The newest manager state has a robot in set-up, or a zone that is being changed.
        """
        if self.state is not None and self.state.zone_change is not None:
            return f"zone {self.state.zone_change} is being changed"
        setup = None if self.state is None else self.state.setup
        if setup is None:
            return ""
        return f"{'it' if setup.robot == self._robot else setup.robot} is in set-up"

    @property
    def silence(self) -> str:
        """What is wrong with a manager state that is not fresh, for people."""
        if self._lower is None:
            return "the manager is silent"
        return (
            f"the manager is silent; one of epoch {self._lower} is heard, which is lower than {self._newest.era} of "
            "before: stop it, or if the clock of its host was set back, start this agent again"
        )

    # Geometry

    @property
    def geometry(self) -> tuple[ZoneGeometry, ...] | None:
        """All zones of the newest manager state in their present version; `None` while one is still missing."""
        if self.state is None or self.unheard:
            return None
        return tuple(self._geometry[name] for name in sorted(self.state.zones))

    @property
    def unheard(self) -> list[str]:
        """The zones of the newest manager state whose present geometry has not been heard."""
        zones = self.state.zones if self.state is not None else {}
        known = {name: zone.version for name, zone in self._geometry.items()}
        return sorted(name for name, status in zones.items() if known.get(name) != status.version)

    def touched(self, body: Body) -> set[str]:
        """The zones that a body touches, by the rule that the manager applies too."""
        for known, zones in self._touched:
            if known is body:
                return set(zones)
        touched = frozenset(
            name for name, solid in self._solids.items() if body_touches(body, solid, self._geometry[name].of)
        )
        self._touched.append((body, touched))
        return set(touched)

    def crossed(self, path: Sweep, margin_m: float) -> list[str] | None:
        """The zones that a swept body, or its TCP, comes nearer to than `margin_m`.

        `None` while a zone's geometry is missing.
        """
        zones, taus = self.geometry, np.arange(len(path.points), dtype=float)
        if zones is None:
            return None
        return [zone.zone for zone in zones if crossings(path, taus, zone, margin_m)]

    # Grants

    def update_holds(self, now: float, inside: set[str], needed: set[str]) -> None:
        """Take up grants that are needed or stood in; give up zones that are neither.

        `inside` are the zones that the body sent last touches, `needed` those crossed soon. The body may be in a zone
        of which it is not heard yet where it is.
        """
        if self.state is None or not self.fresh(now):
            return
        inside = inside.union(self.unheard)
        for name, status in self.state.zones.items():
            token = status.token if status.holder == self._robot else None
            if token is not None and token != self._given_up.get(name) and name in inside | needed:
                self.holds[name] = token
            elif name not in inside and (token is None or name not in needed):
                self.holds.pop(name, None)

    def permitted(self, zone: str, now: float) -> bool:
        """Whether the robot may be inside: a fresh manager state names it holder with the token it has."""
        status = self.state.zones.get(zone) if self.state is not None else None
        return (
            status is not None
            and self.fresh(now)
            and status.state in (ZoneState.GRANTED, ZoneState.OCCUPIED)
            and status.holder == self._robot
            and status.token is not None
            and status.token == self.holds.get(zone)
        )

    def holds_on(self, planned: Planned, tau: float, now: float) -> list[tuple[str, Hold]]:
        """The zones on a motion that may not be entered now, neither forwards nor backwards, with the hold for each.

        From `tau` [s] on; zones between which the robot cannot stop are all held before the first of them. First come
        those that somebody holds.

        Likewise, without a zone, the spaces that an input switches and that are on. Who is inside one stops there.
        """
        if planned.motion.duration_s > 0.0 and not self._planned_against_present(planned):
            return [("", Hold(0.0, "the zones have changed since this motion was planned: halt and run again"))]
        zones = [
            (crossing.zone, Hold(_hold(crossing, entry, tau), self.why_not(crossing.zone), until=crossing.leave_tau))
            for crossing, entry in with_entry(planned.crossings)
            if not self.permitted(crossing.zone, now)
        ]
        zones.sort(key=lambda held: self.state is None or self.state.zones[held[0]].holder in (None, self._robot))
        spaces = [
            ("", Hold(crossing.enter_tau, why, until=crossing.leave_tau))
            for crossing in planned.shut
            if (why := self.spaces.why_on(crossing.zone, now))
        ]
        return zones + spaces

    def changed_since(self, planned: Planned) -> bool:
        """Whether the zones are known to be others than those that a motion was planned against."""
        return self.state is not None and planned.motion.duration_s > 0.0 and not self._planned_against_present(planned)

    def _planned_against_present(self, planned: Planned) -> bool:
        return self.state is not None and planned.zone_versions == {
            name: status.version for name, status in self.state.zones.items()
        }

    def _deadlock(self) -> str:
        """The words after a reason to wait that ends only by an operator."""
        deadlocks = self.state.deadlocks if self.state is not None else ()
        mine = (each for each in deadlocks if self._robot in each.robots)
        return next((f", and {' and '.join(each.robots)} wait for each other: {each.remedy}" for each in mine), "")

    def why_not(self, zone: str) -> str:
        """Why the robot may not enter, for people."""
        if self.state is None:
            return f"zone {zone}: no manager heard yet"
        refusal = self.state.refused.get(self._robot)
        status = self.state.zones.get(zone)
        if refusal or status is None:
            return f"zone {zone}: {refusal or 'unknown to the manager'}"
        since_s = max(0.0, self.state.cell_time - status.since)
        if status.state is ZoneState.ORPHANED:
            return f"zone {zone}: orphaned, last held by {status.holder or 'nobody'} ({status.reason})"
        if status.holder not in (None, self._robot):
            return f"zone {zone}: held by {status.holder} since {since_s:.1f} s{self._deadlock()}"
        return f"zone {zone}: {status.reason or 'asked for'}"


def _hold(crossing: Crossing, entry: float, tau: float) -> float:
    """Where a zone holds a robot that is at `tau`: past the common entry of several it may go on to its own border."""
    return entry if tau <= entry else crossing.enter_tau
