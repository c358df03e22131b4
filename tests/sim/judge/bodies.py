"""Where the robots really are, against what is published of them."""

import re
from dataclasses import dataclass
from math import inf

import numpy as np

from cell.messages import AdoptZone, ClearZone, SetpointBlock, ZoneState, ZoneStatus
from tests.sim.judge.facts import BATCH, Facts, Floats, Sample, SentBlock, Shown, rest_row
from tests.sim.judge.invariant import Handlers, Invariant

_BODY_TOLERANCE_M = 0.002
_HINDERED_M = 0.2
"""So far a robot may get, of which a drive fails, before anybody has measured it."""
_BLOCK_TOLERANCE_M = 0.001
_SETTLE_S = 0.15
"""So long a drive may settle after the last sample of a block."""


class OneBodyInAZone(Invariant):
    """No two real bodies are ever in a zone, but where a drive fails: an axis that was held may swing past its path,
    and where that has brought it to it stays."""

    name = "one body in a zone"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._inside: dict[str, frozenset[str]] = {}
        self._swung: dict[str, frozenset[str]] = {}
        """Zones that robots came into while they were hindered, and have not left."""
        self.time_inside_s = dict.fromkeys(facts.robots, 0.0)

    def look(self, sample: Sample) -> None:
        robot, before = sample.robot, self._inside.get(sample.robot, sample.inside)
        came = sample.inside - before if self.facts.hindered(robot, sample.at) else frozenset()
        self._swung[robot] = (self._swung.get(robot, frozenset()) | came) & sample.inside
        self._inside[robot] = sample.inside
        if sample.inside:
            self.time_inside_s[sample.robot] += 0.02
        for zone in sample.inside:
            both = sorted(robot for robot, zones in self._inside.items() if zone in zones)
            excused = any(self.facts.hindered(robot, sample.at) or zone in self._swung[robot] for robot in both)
            if len(both) > 1 and not excused:
                self.broken(" and ".join(both), f"they are in zone {zone} together", sample.at)


class BodyIsPublished(Invariant):
    """The real body lies within the newest published one."""

    name = "the real body is published"

    def look(self, sample: Sample) -> None:
        if sample.shown is None:
            return
        age = sample.at - sample.shown.at
        hindered = self.facts.hindered(sample.robot, sample.shown.at)
        silent = age > self.facts.cell.times.fresh_s or not sample.spoken_for
        if hindered and (silent or self.facts.unaware(sample.robot, sample.at)):
            # One that is silent may be anywhere: so says the manager once it has noticed, and blocks its zones. What a
            # drive does that fails before, while no agent lives or hears of it, nobody can know.
            return
        missing = float(sample.shown.misses(sample.points[None], sample.tcp[None])[0])
        if missing > (_HINDERED_M if hindered else _BODY_TOLERANCE_M):
            what = f"it is {1000 * missing:.1f} mm outside the body that it published {age:.3f} s before"
            self.broken(sample.robot, what, sample.at)


def _not_granted_yet(zone: ZoneStatus) -> bool:
    """A manager that has just started asks first where everybody is."""
    return zone.reason.startswith("no grants before")


class InsideIsAccountedFor(Invariant):
    """Whoever is really inside a zone is its holder in the newest state of the manager, or the zone is blocked for its
    sake. A drive that fails may let a robot come anywhere."""

    name = "who is inside is holder or suspect"

    def look(self, sample: Sample) -> None:
        if sample.manager is None or self.facts.hindered(sample.robot, sample.at):
            return
        for zone in sample.inside:
            status = sample.manager.zones[zone]
            waits = status.state is ZoneState.FREE and _not_granted_yet(status)
            suspect = status.state is ZoneState.ORPHANED and self._may_be_meant(sample, zone, status.reason)
            if status.holder != sample.robot and not suspect and not waits:
                holder = status.holder or "nobody"
                what = f"it is in zone {zone}, which the manager calls {status.state.value}, held by {holder}"
                self.broken(sample.robot, f"{what}: {status.reason}" if status.reason else what, sample.at)

    def _may_be_meant(self, sample: Sample, zone: str, reason: str) -> bool:
        """The reason names the robot; or it claims the zone by a grant of before the manager's start."""
        token = None if sample.shown is None else sample.shown.message.holds.get(zone)
        claims = token is not None and sample.manager is not None and token.epoch < sample.manager.epoch
        return claims or sample.robot in re.findall(r"\w+", reason)


class BrakingKeepsZones(Invariant):
    """A zone that a robot holds is nobody else's before the robot stands, or has left it: also where a drive has failed
    and it brakes as it can. An operator may free it, and one who pushes the robot may bring it anywhere."""

    name = "who brakes keeps its zones"
    _STANDS_S = 0.1

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._held: dict[str, frozenset[str]] = dict.fromkeys(facts.robots, frozenset())
        self._lost: dict[str, dict[str, float]] = {robot: {} for robot in facts.robots}
        """Zones that a robot has lost since it stood, and when."""
        self._moved_at = dict.fromkeys(facts.robots, -inf)

    def look(self, sample: Sample) -> None:
        robot, lost, manager = sample.robot, self._lost[sample.robot], sample.manager
        if manager is None:
            return
        if sample.moving:
            self._moved_at[robot] = sample.at
        held = frozenset(
            name
            for name, zone in manager.zones.items()
            if zone.holder == robot or zone.state is ZoneState.ORPHANED or _not_granted_yet(zone)
        )
        for zone in self._held[robot] - held:
            lost[zone] = sample.at
        self._held[robot] = held
        stood = sample.at - self._moved_at[robot] > self._STANDS_S or sample.at < self.facts.slips_until.get(robot, 0.0)
        for zone in [*lost] if stood else held & lost.keys():
            del lost[zone]
        for zone in sample.inside & lost.keys():
            if not self._decided(zone, lost[zone]):
                self.broken(
                    robot, f"it is in zone {zone}, which it lost {sample.at - lost[zone]:.2f} s before", sample.at
                )

    def _decided(self, zone: str, at: float) -> bool:
        """An operator had ordered, shortly before, that the zone is free or another's."""
        return any(
            0.0 <= at - told_at < self.facts.cell.times.fresh_s
            and isinstance(call.command, AdoptZone | ClearZone)
            and call.command.zone == zone
            for told_at, call in self.facts.told["manager"].calls
        )


@dataclass(frozen=True, slots=True, eq=False)
class _Announced:
    """A block and the presence that was published before it."""

    block: SentBlock
    shown: Shown | None
    rows: Floats


class BlockIsPublished(Invariant):
    """What a block leads through lies within the body that was published before it."""

    name = "a block stays within the published body"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._kept: list[_Announced] = []

    @property
    def published(self) -> Handlers:
        return {SetpointBlock: self._block}

    def _block(self, _: str, block: SetpointBlock) -> None:
        feedback = self.facts.feedback.get(block.robot)
        if feedback is None or not feedback.enabled:
            return
        last = rest_row(block)
        if last == 0:
            return
        rows = block.position[sorted({0, last // 2, last})]
        shown = self.facts.shown.get(block.robot)
        self._kept.append(_Announced(SentBlock(block, self.facts.now), shown, rows))
        if len(self._kept) >= BATCH:
            self.flush()

    def flush(self) -> None:
        kept, self._kept = self._kept, []
        for robot in self.facts.robots:
            mine = [each for each in kept if each.block.message.robot == robot]
            if mine:
                axes = np.concatenate([each.rows for each in mine])
                ends = np.cumsum([len(each.rows) for each in mine])[:-1]
                bodies, tcps = (np.split(of(robot, axes), ends) for of in (self.facts.points, self.facts.tcp))
                for each, points, tcp in zip(mine, bodies, tcps, strict=True):
                    self._judge(robot, each, points, tcp)

    def _judge(self, robot: str, each: _Announced, points: Floats, tcp: Floats) -> None:
        number, at = each.block.message.sequence, each.block.at
        if each.shown is None:
            self.broken(robot, f"block {number} moves it, and it has published no body", at)
        missing = float(each.shown.misses(points, tcp).max())
        if missing > _BLOCK_TOLERANCE_M:
            what = f"block {number} leads {1000 * missing:.1f} mm out of the body published before it"
            self.broken(robot, what, at)


class StopTimeIsTrue(Invariant):
    """A robot that says it stands stands, and after the time that it said it does; a gateway that is frozen meanwhile
    plays the rest of a ramp afterwards, in the space that was said."""

    name = "the stop time is true"

    def look(self, sample: Sample) -> None:
        shown = sample.shown
        if shown is None or not sample.moving or not shown.message.body.known:
            return
        if self.facts.hindered(sample.robot, shown.at):
            return
        said_s = shown.message.stop_time_s
        frozen_s = self.facts.frozen_s(self.facts.gateway_of(sample.robot), shown.at)
        over_s = sample.at - shown.at - said_s - frozen_s
        if over_s > _SETTLE_S:
            self.broken(
                sample.robot, f"it moves {over_s:.2f} s after the {said_s:.3f} s that it said to need", sample.at
            )
        still_s = sample.at - shown.still_since
        if still_s > _SETTLE_S:
            self.broken(sample.robot, f"it moves, and has said for {still_s:.2f} s that it stands", sample.at)
