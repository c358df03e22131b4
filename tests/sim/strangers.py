"""Messages that nobody of the cell has sent, each of which its addressee has one reason to refuse or to act upon."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from cell.config.settings import CellSettings
from cell.messages import (
    Body,
    Claim,
    DriveFeedback,
    Halt,
    ManagerState,
    OutputEvent,
    Presence,
    SetpointBlock,
    SwitchOutput,
    ZoneState,
)
from tests.sim.item import Item, Stage
from tests.sim.judge.facts import STRANGER, Shown, rest_row
from tests.sim.world import World

WRONG_DIGEST = "0" * 64
GUEST = "guest"
_LOOK_S = 0.03
_WAITS_S = 8.0
"""For the moment that it needs."""
_ROWS, _ASIDE, _GAP, _LEAD_S = 40, 0.01, 1e-4, 0.08
"""Samples, the way of the first axis and the gap in front of it [rad or m], how far ahead a block begins."""
_ROUNDS, _ROUND_S = 5, 0.23
_CALM_S = 0.5
"""No claim that is asked for now ends before that is answered."""
_AHEAD = 3
"""So many sequences a false presence is ahead of the true ones."""
_AGAIN_S, _HALTED_S = 0.15, 3.0
_STAYS_S, _LEAVES_S, _SAYS_S = 1.5, 6.0, 0.1
_FAR_M = 100.0
_CROWD = 10


@dataclass(frozen=True, slots=True)
class Strays(Item):
    """Whenever the robot stands, somebody else sends blocks that would move it, each with another reason for its
    gateway to refuse it."""

    kind: ClassVar[str] = "stray blocks"
    robot: str

    def strike(self, stage: Stage) -> float:
        self._send(stage, stage.facts.now + _WAITS_S, _ROUNDS)
        return 0.0

    def _send(self, stage: Stage, until: float, rounds: int) -> None:
        feedback, newest = stage.facts.feedback.get(self.robot), stage.facts.newest_block.get(self.robot)
        stands = feedback is not None and feedback.enabled and newest is not None and rest_row(newest.message) == 0
        if stands and feedback is not None and feedback.block > 0:
            for block in _strays(feedback, stage.world.cycle_s(self.robot)):
                stage.world.publish(block, STRANGER)
            rounds -= 1
        if rounds > 0 and stage.facts.now < until:
            stage.world.clock.after(_ROUND_S if stands else _LOOK_S, self._send, stage, until, rounds)


def _strays(feedback: DriveFeedback, cycle_s: float) -> Iterator[SetpointBlock]:
    share = np.linspace(0.0, 1.0, _ROWS)[:, None]
    aside = np.zeros(len(feedback.commanded))
    aside[0] = _ASIDE
    smooth = feedback.commanded + aside * (share - np.sin(2.0 * np.pi * share) / (2.0 * np.pi))
    lead = max(4, round(_LEAD_S / cycle_s))
    good = SetpointBlock(
        feedback.robot, feedback.owner, feedback.block + 20, feedback.block, feedback.tick + lead, cycle_s,
        _ROWS // 2, smooth, _velocity(smooth, cycle_s),
    )  # fmt: skip
    yield replace(good, owner=good.owner - 1)
    yield replace(good, sequence=max(1, feedback.block - 2))
    yield replace(good, first_tick=feedback.tick - lead)
    beside = smooth.copy()
    beside[:, 0] += _GAP
    yield replace(good, position=beside)
    # Ever faster, but so slowly that it is fast nowhere: only its end is wrong.
    endless = feedback.commanded + 0.1 * aside * share**2
    velocity = np.gradient(endless, cycle_s, axis=0)
    velocity[0] = 0.0
    yield replace(good, position=endless, velocity=velocity)


def _velocity(position: NDArray[np.float64], cycle_s: float) -> NDArray[np.float64]:
    velocity = np.gradient(position, cycle_s, axis=0)
    velocity[[0, -1]] = 0.0
    return velocity


@dataclass(frozen=True, slots=True)
class SaidAgain(Item):
    """A robot that has switched an output on is halted, and the output switched off by hand; then a block says that
    event again."""

    kind: ClassVar[str] = "event said again"
    by: str
    robot: str

    def strike(self, stage: Stage) -> float:
        self._look(stage, stage.facts.now + _WAITS_S)
        return 0.0

    def _look(self, stage: Stage, until: float) -> None:
        """Wait for an event that was executed, and halt."""
        event = self._executed(stage)
        if event is not None:
            stage.staff.leave_alone(self.robot, _HALTED_S)
            stage.world.operate(f"robot/{self.robot}", Halt(), self.by)
            owner = stage.facts.feedback[self.robot].owner
            self._again(stage, event, owner, stage.facts.now + _HALTED_S)
        elif stage.facts.now < until:
            stage.world.clock.after(_LOOK_S, self._look, stage, until)

    def _executed(self, stage: Stage) -> OutputEvent | None:
        """The newest event of the present owner that has switched something on."""
        feedback = stage.facts.feedback.get(self.robot)
        if feedback is None or not feedback.enabled:
            return None
        blocks = stage.facts.blocks[self.robot].items()
        said = [each for (owner, _), sent in blocks if owner == feedback.owner for each in sent.message.events]
        return next((each for each in reversed(said) if each.value and each.number <= feedback.event), None)

    def _again(self, stage: Stage, event: OutputEvent, owner: int, until: float) -> None:
        """While the robot is halted: as soon as the output is off, say the event. Another owner counts anew."""
        facts = stage.facts
        feedback, newest = facts.feedback[self.robot], facts.newest_block[self.robot].message
        if facts.now > until or feedback.owner != owner:
            return
        stage.world.clock.after(_AGAIN_S, self._again, stage, event, owner, until)
        if not feedback.enabled or not _halted(newest, owner):
            return
        if not feedback.outputs >> event.output & 1:
            stage.world.on_published.append(_Doubled(stage.world, self.robot, owner, event))
        else:
            switch = SwitchOutput(self.robot, "gripper", False, self.by)
            stage.world.operate(facts.gateway_of(self.robot), switch, self.by)


@dataclass(slots=True)
class _Doubled:
    """The next block of a robot's owner comes twice, once of them with an event; whichever is first is played.

    So the robot's agent is right about where a block of its number leads.
    """

    world: World
    robot: str
    owner: int
    event: OutputEvent | None

    def __call__(self, _name: str, message: object) -> None:
        if self.event is None or not isinstance(message, SetpointBlock) or message.robot != self.robot:
            return
        event, self.event = replace(self.event, tick=message.first_tick), None
        if _halted(message, self.owner):
            block = replace(message, nominal=max(1, message.nominal), events=(event,))
            self.world.publish(block, f"double of {self.robot}")


def _halted(block: SetpointBlock, owner: int) -> bool:
    """This owner's robot stands, and runs no program."""
    return block.owner == owner and not block.program and rest_row(block) == 0


@dataclass(frozen=True, slots=True)
class FalsePresence(Item):
    """Of a robot that stands and holds nothing come presences as of one that must not get a zone: it has another
    configuration, or it does not know where it is. They ask for a zone that is free."""

    kind: ClassVar[str] = "false presence"
    robot: str

    def strike(self, stage: Stage) -> float:
        self._send(stage, stage.facts.now + 2.0 * _WAITS_S, 2 * _ROUNDS)
        return 0.0

    def _send(self, stage: Stage, until: float, rounds: int) -> None:
        facts = stage.facts
        shown, zone = facts.shown.get(self.robot), self._free(facts.cell, facts.manager)
        stands = shown is not None and facts.now - shown.still_since > 0.1 and not shown.message.holds
        if stands and shown is not None and zone:
            true = shown.message
            asks = replace(true, sequence=true.sequence + _AHEAD, wants={zone: 0.0}, standing=False)
            lost = replace(asks, body=Body(False, true.body.base, 1e-3))
            false = replace(asks, digest=WRONG_DIGEST) if rounds % 2 else lost
            stage.world.publish(false, STRANGER)
            rounds -= 1
        if rounds > 0 and facts.now < until:
            stage.world.clock.after(_ROUND_S if stands and zone else _LOOK_S, self._send, stage, until, rounds)

    def _free(self, cell: CellSettings, manager: ManagerState | None) -> str:
        """A zone that this robot would get if it asked for it."""
        zones = {} if manager is None or manager.estops else manager.zones
        free = {zone for zone, known in zones.items() if known.state is ZoneState.FREE and not known.reason}
        good = (zone for zone in sorted(free) if not zones[zone].queue and self.robot in cell.zones[zone].robots)
        return next(good, "")


@dataclass(frozen=True, slots=True)
class FalseEnd(Item):
    """Whenever an emergency stop is in force for a while, somebody who is not the manager says that it is over."""

    kind: ClassVar[str] = "false end of a stop"

    def strike(self, stage: Stage) -> float:
        self._look(stage, stage.facts.now + 2.0 * _WAITS_S, set())
        return 0.0

    def _look(self, stage: Stage, until: float, known: set[str]) -> None:
        """Of those that were in force before, so that the robots may stand under them by now."""
        facts = stage.facts
        stops = {} if facts.manager is None else {estop.id: estop for estop in facts.manager.estops}
        for estop in stops.values():
            if estop.id in known:
                stage.world.publish(replace(estop, active=False), STRANGER)
        if facts.now < until:
            stage.world.clock.after(_ROUND_S, self._look, stage, until, set(stops))


@dataclass(frozen=True, slots=True)
class Guest(Item):
    """A robot that is not in the cell file says for a while that it is where another stands inside its zone, and then
    that it is far away."""

    kind: ClassVar[str] = "guest"

    def strike(self, stage: Stage) -> float:
        self._look(stage, stage.facts.now + _WAITS_S)
        return _STAYS_S + 0.5

    def _look(self, stage: Stage, until: float) -> None:
        facts = stage.facts
        holder = next((robot for robot in facts.robots if self._holds(stage, robot)), "")
        if holder:
            shown = facts.shown[holder]
            boot = f"{GUEST}-{facts.now:.3f}"
            body = shown.message.body
            away = replace(body, poses=np.full_like(body.poses, _FAR_M), tcp_m=np.full_like(body.tcp_m, _FAR_M))
            presence = replace(
                shown.message, robot=GUEST, boot=boot, owner=int(1000 * facts.now), digest=WRONG_DIGEST, holds={},
                wants={}, stop_time_s=0.1, estop_acknowledged=None,
            )  # fmt: skip
            self._say(stage, presence, replace(presence, body=away), facts.now, 1)
        elif facts.now < until:
            stage.world.clock.after(_LOOK_S, self._look, stage, until)

    def _holds(self, stage: Stage, robot: str) -> bool:
        manager, shown = stage.facts.manager, stage.facts.shown.get(robot)
        if manager is None or shown is None or not shown.message.body.known:
            return False
        zones = stage.facts.inside_now(robot)
        return any(manager.zones[z].holder == robot and self._touches(stage, shown, z) for z in zones)

    def _touches(self, stage: Stage, shown: Shown, zone: str) -> bool:
        return shown.touches(zone, stage.facts.boxes[zone])

    def _say(self, stage: Stage, here: Presence, away: Presence, since: float, sequence: int) -> None:
        past_s = stage.facts.now - since
        heard = stage.world.operator(STRANGER).heard("manager")
        stage.world.publish(replace(here if past_s < _STAYS_S else away, sequence=sequence, heard=heard), STRANGER)
        if past_s < _STAYS_S + _LEAVES_S:
            stage.world.clock.after(_SAYS_S, self._say, stage, here, away, since, sequence + 1)


@dataclass(frozen=True, slots=True)
class Crowd(Item):
    """More robots that are not in the cell file than a manager follows, all far away."""

    kind: ClassVar[str] = "crowd"

    def strike(self, stage: Stage) -> float:
        self._say(stage, stage.facts.now + _STAYS_S, 1)
        return _STAYS_S

    def _say(self, stage: Stage, until: float, sequence: int) -> None:
        facts, world = stage.facts, stage.world
        for shown in list(facts.shown.values())[:1]:
            body = shown.message.body
            away = replace(body, poses=np.full_like(body.poses, _FAR_M), tcp_m=np.full_like(body.tcp_m, _FAR_M))
            for number in range(_CROWD):
                presence = replace(
                    shown.message, robot=f"{GUEST}_{number}", boot=f"{GUEST}-{until:.3f}", owner=int(1000 * until),
                    digest=WRONG_DIGEST, holds={}, wants={}, stop_time_s=0.1, estop_acknowledged=None, body=away,
                    sequence=sequence, heard=world.operator(STRANGER).heard("manager"),
                )  # fmt: skip
                world.publish(presence, STRANGER)
        if facts.now < until:
            world.clock.after(_SAYS_S, self._say, stage, until, sequence + 1)


@dataclass(frozen=True, slots=True)
class SecondAgent(Item):
    """Somebody else claims a robot whose agent lives."""

    kind: ClassVar[str] = "second agent"
    robot: str

    def strike(self, stage: Stage) -> float:
        self._claim(stage, stage.facts.now + _WAITS_S, _ROUNDS)
        return 0.0

    def _claim(self, stage: Stage, until: float, rounds: int) -> None:
        facts, world, gateway = stage.facts, stage.world, stage.facts.gateway_of(self.robot)
        feedback, newest = facts.feedback.get(self.robot), facts.newest_block.get(self.robot)
        lives = facts.calm(_CALM_S) and newest is not None and facts.now - newest.at < _LOOK_S
        if lives and facts.cell.times.owner_silent_s >= _CALM_S and feedback is not None and feedback.owner > 0:
            world.operate(gateway, Claim(self.robot, "second agent", facts.cell.digest), STRANGER)
            rounds -= 1
        if rounds > 0 and facts.now < until:
            world.clock.after(_ROUND_S, self._claim, stage, until, rounds)
