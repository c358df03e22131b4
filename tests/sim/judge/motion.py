"""What the drives are commanded, against what was sent, planned, allowed and ordered."""

from collections import defaultdict, deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf
from struct import Struct

import numpy as np
from numpy.typing import NDArray

from cell.core import Request
from cell.messages import (
    Call,
    Continue,
    DriveFeedback,
    Enable,
    Estop,
    GatewayState,
    Jog,
    Mode,
    PlayoutState,
    Presence,
    Reply,
    ResetDrives,
    Return,
    RobotState,
    Run,
    SetpointBlock,
    Step,
)
from drive_gateway.canopen.axis_objects import index_of
from drive_gateway.canopen.cob_id import NMT
from drive_gateway.gateway.effects import Frame
from drive_gateway.sim.services.dictionary import key_of
from robot_agent.agent.planning.plans import Planned
from tests.sim.judge.facts import OFF_S, SAMPLE_S, Facts, Floats, Sample, rest_row
from tests.sim.judge.invariant import Handlers, Invariant
from tests.sim.planned_paths import PATH_STEP_S, PlannedPaths

_LIMIT_TOLERANCE = 1.01
_ON_PATH = 2e-6
"""[rad or m] beside what a chord of a path is away from it."""
_MOST_KEPT = 64
"""Samples of one robot that are judged together."""
_BEFORE = 4
"""Judged samples that are kept: a jerk takes four."""
_BLOCK_ARRIVES_S = 0.2
"""So long after it was sent, at the latest, what a block begins is played."""
_TURNS_S = 1.0
"""So long after its override is no longer negative, at the latest, a robot that went back goes on."""
_JOINING = 1e-6
"""[rad or m] A block may begin so much beside what is commanded."""
_TARGETS = ((0x607A, 0), (0x60C1, 1))
"""CiA 402: target position, and the first interpolation data."""
_MOVES = (Run, Continue, Return, Step, Jog)
_LIVE = (PlayoutState.PLAYING, PlayoutState.RAMP, PlayoutState.STARVED)


@dataclass(slots=True)
class _Commanded:
    """What one robot was commanded since it was enabled, in axes, with the last samples that are judged."""

    at: list[float] = field(default_factory=list)
    axes: list[Floats] = field(default_factory=list)
    jogged: list[bool] = field(default_factory=list)
    backwards: list[bool] = field(default_factory=list)
    judged: int = 0
    plans: int = 0
    """So many had been made when the samples were taken."""

    def forget(self, kept: int) -> None:
        """All are judged; keep the newest."""
        start = len(self.at) - kept
        self.at, self.axes = self.at[start:], self.axes[start:]
        self.jogged, self.backwards = self.jogged[start:], self.backwards[start:]
        self.judged = len(self.at)


class _OfCommands(Invariant):
    """Judges what the drives are commanded, many samples at once."""

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._commanded = {robot: _Commanded() for robot in facts.robots}
        self._jogging = dict.fromkeys(facts.robots, False)
        self._jogged_at = dict.fromkeys(facts.robots, -inf)
        self._backwards_at = dict.fromkeys(facts.robots, -inf)

    @property
    def published(self) -> Handlers:
        return {DriveFeedback: self._feedback}

    def _feedback(self, _: str, feedback: DriveFeedback) -> None:
        robot, facts = feedback.robot, self.facts
        kept, plans = self._commanded[robot], len(facts.world.seen.planned[robot])
        if not feedback.enabled or plans != kept.plans or len(kept.at) - kept.judged >= _MOST_KEPT:
            self._judge_kept(robot)
            kept.plans = plans
        if not feedback.enabled:
            kept.forget(0)
            return
        state = facts.states.get(robot)
        if state is not None and state.mode is Mode.JOGGING:
            self._jogged_at[robot] = facts.now
        if state is not None and state.pace.override < 0.0:
            self._backwards_at[robot] = facts.now
        jogs = facts.now - self._jogged_at[robot] < _BLOCK_ARRIVES_S
        moves_on = self._jogging[robot] and bool(kept.axes) and not np.array_equal(kept.axes[-1], feedback.commanded)
        self._jogging[robot] = jogs or moves_on
        kept.at.append(facts.now)
        kept.axes.append(feedback.commanded)
        kept.jogged.append(self._jogging[robot])
        kept.backwards.append(facts.now - self._backwards_at[robot] < _TURNS_S)

    def flush(self) -> None:
        for robot in self._commanded:
            self._judge_kept(robot)

    def _judge_kept(self, robot: str) -> None:
        kept = self._commanded[robot]
        if len(kept.at) > kept.judged:
            q = self.facts.world.models[robot].coupling.joints(np.array(kept.axes))
            self.judge(robot, q, kept)
            kept.forget(min(_BEFORE, len(q)))

    def judge(self, robot: str, q: Floats, kept: _Commanded) -> None:
        """Joints `(m, n)`, of which the first `kept.judged` have been judged."""
        raise NotImplementedError


class WithinLimits(_OfCommands):
    """Velocity, acceleration and jerk of each joint are within the limits of ramps, by the differences of what the
    drives are commanded."""

    name = "joints keep their limits"

    def judge(self, robot: str, q: Floats, kept: _Commanded) -> None:
        first = max(_BEFORE - 1, kept.judged)
        limits, dt = self.facts.world.planners[robot].limits, self.facts.world.cycle_s(robot)
        rows = q
        for order, what, allowed in (
            (1, "velocity", limits.velocity),
            (2, "acceleration", limits.ramp_acceleration_bounds[1]),
            (3, "jerk", limits.ramp_jerk),
        ):
            rows = np.diff(rows, axis=0) / dt
            found = rows[first - order :]
            beyond = np.flatnonzero((np.abs(found) > allowed * _LIMIT_TOLERANCE).any(axis=1))
            if len(beyond):
                share = (np.abs(found[beyond[0]]) / allowed).max()
                self.broken(robot, f"{what} is {share:.3f} of what is allowed", kept.at[first + beyond[0]])


class DrivesGetWhatIsSaid(Invariant):
    """The target in the newest frame to each drive before a SYNC is what the gateway says that it commands then.

    So what is judged by feedback is what the drives play. Targets are read by the drives' own mappings.
    """

    name = "drives get what is said"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        gateways = facts.world.bundle.gateways
        self._axes = {
            robot: gateways[facts.gateway_of(robot).partition("/")[2]].robots[robot].axes for robot in facts.robots
        }
        self._newest = {robot: np.full(len(axes), np.nan) for robot, axes in self._axes.items()}
        self._before = {robot: newest.copy() for robot, newest in self._newest.items()}
        self._places: dict[tuple[str, int], list[tuple[str, int, Struct, int]]] = {}
        """By gateway and COB-ID: whose target is where in a frame."""

    @property
    def effects(self) -> Handlers:
        return {Frame: self._frame}

    @property
    def published(self) -> Handlers:
        return {DriveFeedback: self._feedback}

    def _frame(self, gateway: str, effect: Frame) -> None:
        key = gateway, effect.frame.id
        if effect.frame.id == NMT:  # nodes may have other mappings after it
            self._places.clear()
        places = self._places[key] = self._places.get(key) or self._found(*key)
        for robot, axis, layout, place in places:
            self._newest[robot][axis] = layout.unpack_from(effect.frame.data)[place]

    def _found(self, gateway: str, cob_id: int) -> list[tuple[str, int, Struct, int]]:
        found = []
        for robot, axes in self._axes.items():
            for index, axis in enumerate(axes) if self.facts.gateway_of(robot) == gateway else ():
                targets = [key_of(index_of(target, axis.number), sub) for target, sub in _TARGETS]
                for pdo in self.facts.world.buses[gateway].nodes[axis.node_id]._receive:
                    found += [
                        (robot, index, pdo._layout, pdo._keys.index(key))
                        for key in targets
                        if pdo.cob_id == cob_id and key in pdo._keys
                    ]
        return found

    def _feedback(self, _: str, feedback: DriveFeedback) -> None:
        robot = feedback.robot
        got, self._before[robot] = self._before[robot], self._newest[robot].copy()
        if not feedback.enabled or self.facts.world.buses[self.facts.gateway_of(robot)].broken:
            return
        axes = self._axes[robot]
        said = [(q - axis.offset) * axis.counts_per_unit for q, axis in zip(feedback.commanded, axes, strict=True)]
        beside = np.abs(got - said)
        if (beside > 1.0).any():
            axis = axes[int(np.nanargmax(beside))].name
            self.broken(
                robot, f"{axis} got a target {np.nanmax(beside):.0f} counts beside what is said to be commanded"
            )


class OnThisMotion(_OfCommands):
    """The robot is on the motion that its program has come to or, on its way back, on that; never on an older one, but
    where a negative override takes it back over one after another."""

    name = "on this motion"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._paths = PlannedPaths()
        planners = facts.world.planners
        self._allowed = {
            robot: _ON_PATH + float(planners[robot].limits.acceleration.max()) * PATH_STEP_S**2 / 8.0
            for robot in facts.robots
        }
        self._cursor = dict.fromkeys(facts.robots, 0)
        self._back = dict.fromkeys(facts.robots, 0)
        """The newest way back to the path that has been seen, by its number; 0: none."""
        self._first: dict[int, Planned] = {}
        """By sweep: the same plan that is given again has the same."""

    def _off(self, planned: Sequence[Planned], q: Floats, allowed: float) -> Floats:
        motions = [self._first.setdefault(id(each.sweep), each).motion for each in planned]
        return self._paths.off(motions, q, allowed)

    def judge(self, robot: str, q: Floats, kept: _Commanded) -> None:
        first = max(1, kept.judged)
        moved = first + np.flatnonzero((q[first:] != q[first - 1 : -1]).any(axis=1))
        moved = moved[~np.array(kept.jogged)[moved]] if moved.size else moved
        if not moved.size:
            return
        planned, allowed = self.facts.world.seen.planned[robot][: kept.plans], self._allowed[robot]
        backs = [each for each in planned if each.id < 0][-1:]
        left = np.ones(len(moved), dtype=bool)
        if backs:
            left = self._off(backs, q[moved], allowed) > allowed
            if self._back[robot] != backs[0].id:
                # What a robot had not followed yet when it was stopped may lie on the motion before.
                self._back[robot], self._cursor[robot] = backs[0].id, max(self._cursor[robot] - 1, 0)
        # In a loop the motions behind are as those ahead: who goes back is looked for behind first.
        left = self._gone_back(robot, q, moved, left, kept)
        cursor, on_it = self._cursor[robot], len(moved) - int(left.sum())
        while left.any() and cursor < len(planned):
            motion = planned[cursor]
            if motion.id >= 0:
                off = self._off([motion], q[moved[left]], allowed) > allowed
                if not off.all():
                    self._cursor[robot] = cursor
                    on_it += int((~off).sum())
                left[left] = off
            cursor += 1
        if left.any():
            worst = moved[np.flatnonzero(left)[0]]
            everywhere = self._off(planned, q[moved[left]], allowed)
            old = "an older motion" if (everywhere <= allowed).all() else "no motion that was planned"
            self.broken(robot, f"it is on {old}", kept.at[worst])

    def _gone_back(
        self, robot: str, q: Floats, moved: NDArray[np.intp], left: NDArray[np.bool_], kept: _Commanded
    ) -> NDArray[np.bool_]:
        """Which of `moved` are still `left` on no motion, with those that a robot may have gone back to."""
        back = left & np.array(kept.backwards)[moved]
        planned = self.facts.world.seen.planned[robot][: kept.plans]
        cursor = min(self._cursor[robot], len(planned) - 1)
        while back.any() and cursor >= 0:
            motion = planned[cursor]
            if motion.id >= 0:
                off = self._off([motion], q[moved[back]], self._allowed[robot]) > self._allowed[robot]
                if not off.all():
                    self._cursor[robot] = cursor
                left[back] = off
                back[back] = off
            cursor -= 1
        return left


class PlaysBlocks(Invariant):
    """What the drives are commanded at a tick is the sample of a block of their owner, the newest that was accepted or,
    before its first tick, one of those before it."""

    name = "plays what was sent"
    _LOOK_BACK = 40

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._owners: dict[str, int] = {}
        self._accepted: dict[str, deque[int]] = defaultdict(lambda: deque(maxlen=self._LOOK_BACK))
        """The newest blocks that were said to be accepted; between two of them may lie many."""
        self._newest: dict[str, tuple[str, int, int]] = {}
        """Boot and owner of the newest feedback, and the block that it names."""
        self._before: dict[str, tuple[int, int]] = {}
        """The newest block of before the drives were on, and the tick up to which they hold: it is not played any
        more."""

    @property
    def published(self) -> Handlers:
        return {DriveFeedback: self._feedback}

    def _feedback(self, name: str, feedback: DriveFeedback) -> None:
        robot, blocks = feedback.robot, self.facts.blocks[feedback.robot]
        if not feedback.enabled or feedback.state not in _LIVE:
            self._before[robot] = feedback.block, 0
        elif feedback.owner != self._owners.get(robot):
            self._before[robot] = 0, 0
            self._accepted[robot].clear()
        self._owners[robot] = feedback.owner
        before, held_until = self._before.get(robot, (0, 0))
        last = self._newest.get(robot)
        self._newest[robot] = key = feedback.boot, feedback.owner, feedback.block
        if last is not None and last[:2] == key[:2] and feedback.block < last[2]:
            self.broken(name, f"block {feedback.block} of {robot} is accepted after block {last[2]}")
        if feedback.block in (0, before):
            return
        newest = blocks.get((feedback.owner, feedback.block))
        if newest is None:
            self.broken(name, f"block {feedback.block} of owner {feedback.owner}, which nobody sent, is accepted")
        accepted = self._accepted[robot]
        if feedback.block not in accepted:
            accepted.append(feedback.block)
        if held_until == 0:
            held_until = newest.message.first_tick
            self._before[robot] = before, held_until
        if feedback.tick < held_until:
            return
        recent = range(feedback.block, max(before, feedback.block - self._LOOK_BACK), -1)
        for number in (*recent, *reversed(accepted)):
            sent = blocks.get((feedback.owner, number))
            if sent is not None and feedback.tick >= sent.message.first_tick:
                rows = sent.message.position
                sample = rows[min(feedback.tick - sent.message.first_tick, len(rows) - 1)]
                if np.abs(sample - feedback.commanded).max() <= _JOINING:
                    return
        self.broken(name, f"tick {feedback.tick} of {robot} is the sample of no block that was sent")


class _OfBlocks(Invariant):
    """Judges whether a block leads farther than those that were sent while its robot was allowed to go on."""

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._latest_rest: dict[tuple[str, int], int] = {}
        """By robot and owner: the latest tick of rest of the blocks that were sent when the robot might go on."""

    @property
    def published(self) -> Handlers:
        return {SetpointBlock: self._block}

    def _block(self, _: str, block: SetpointBlock) -> None:
        robot = block.robot
        feedback = self.facts.feedback.get(robot)
        if feedback is None or not feedback.enabled:
            return
        why = self.must_stop(robot)
        row = rest_row(block)
        if row == 0:
            return
        rest = block.first_tick + row
        latest = self._latest_rest.get((robot, block.owner), 0)
        if not why:
            self._latest_rest[robot, block.owner] = max(latest, rest)
        elif rest > latest:
            self.broken(robot, f"block {block.sequence} leads on to tick {rest}, those before to {latest}, and {why}")

    def must_stop(self, robot: str) -> str:
        """Why the robot may only brake; empty when it may go on."""
        raise NotImplementedError


class StopsWithoutManager(_OfBlocks):
    """Without a manager state that answers a presence of less than the age limit ago, a robot only brakes."""

    name = "stops without a manager"

    def must_stop(self, robot: str) -> str:
        if self.facts.manager_fresh(robot):
            return ""
        return f"its newest manager state is {self.facts.manager_age(robot):.3f} s old"


class StopsUnderEstop(_OfBlocks):
    """From an emergency stop that its agent was told until it is told that it is cleared, a robot only brakes."""

    name = "stops under an emergency stop"

    def must_stop(self, robot: str) -> str:
        estops = self.facts.told[f"robot/{robot}"].estops
        return (
            f"emergency stop {min(estops)} was told {self.facts.now - min(estops.values()):.3f} s ago" if estops else ""
        )

    @property
    def published(self) -> Handlers:
        return {SetpointBlock: self._block, Presence: self._presence}

    def _presence(self, name: str, presence: Presence) -> None:
        estops = self.facts.told[name].estops
        if estops and presence.estop_acknowledged is None:
            self.broken(presence.robot, f"it was told of emergency stop {min(estops)} and does not acknowledge it")


class GatewayObeysEstop(Invariant):
    """A robot whose gateway was told of an emergency stop is at rest and without torque within the gateway's delay, and
    the gateway says that it stands under one."""

    name = "a gateway obeys an emergency stop"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._heard: dict[str, set[str]] = defaultdict(set)
        """Stops that came to a gateway by themselves: in a state of the manager it looks for ends alone."""

    def lived(self, name: str, what: str) -> None:
        if what == "started":
            self._heard.pop(name, None)

    @property
    def delivered(self) -> Handlers:
        return {Estop: self._told}

    @property
    def published(self) -> Handlers:
        return {DriveFeedback: self._feedback, GatewayState: self._state}

    def _told(self, name: str, estop: Estop) -> None:
        if estop.active:
            self._heard[name].add(estop.id)

    def _state(self, name: str, state: GatewayState) -> None:
        stops = self.facts.told[name].estops.keys() & self._heard[name]
        if stops and state.estop is None:
            self.broken(name, f"it was told of emergency stop {min(stops)}, and says that there is none")

    def _over_s(self, gateway: str, at: float) -> float:
        """How long the time to obey has been over."""
        told = self.facts.told[gateway]
        if not told.estops or not self.facts.alive(gateway):
            return -inf
        since = max(min(told.estops.values()), told.thawed_at)
        return at - since - self.facts.cell.times.estop_delay_s - OFF_S

    def _feedback(self, name: str, feedback: DriveFeedback) -> None:
        over_s = self._over_s(name, self.facts.now)
        if over_s > 0.0 and feedback.enabled and not self.facts.hindered(feedback.robot):
            self.broken(name, f"{feedback.robot} is on {over_s:.2f} s after it had to be off under an emergency stop")

    def look(self, sample: Sample) -> None:
        over_s = self._over_s(self.facts.gateway_of(sample.robot), sample.at)
        if over_s > 0.0 and sample.moving:
            self.broken(
                sample.robot, f"it moves {over_s:.2f} s after it had to stand under an emergency stop", sample.at
            )


class ConfirmedIsStopped(Invariant):
    """A gateway that confirms an emergency stop has robots that stand, and no torque on any drive that it hears."""

    name = "a confirmed emergency stop has stopped"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._since: dict[str, float] = {}
        """Since when a gateway confirms a stop."""

    @property
    def published(self) -> Handlers:
        return {GatewayState: self._state}

    def lived(self, name: str, _: str) -> None:
        self._since.pop(name, None)

    def _state(self, name: str, state: GatewayState) -> None:
        if state.estop_confirmed is None:
            self._since.pop(name, None)
            return
        self._since.setdefault(name, self.facts.now)
        for robot, settings in self.facts.cell.robots.items():
            feedback = self.facts.feedback.get(robot)
            if f"gateway/{settings.gateway}" == name and feedback is not None and feedback.enabled:
                self.broken(name, f"it confirms emergency stop {state.estop_confirmed}, and {robot} is on")

    def look(self, sample: Sample) -> None:
        gateway = self.facts.gateway_of(sample.robot)
        if sample.moving and sample.at - self._since.get(gateway, inf) > SAMPLE_S:
            self.broken(sample.robot, "it moves, and its gateway has confirmed an emergency stop", sample.at)


class LateCyclesStop(Invariant):
    """A gateway that stood still for longer than its cycle may be late stops the robots that it drove."""

    name = "a cycle that is far too late stops"
    _WITHIN_S = 0.1
    _MORE_S = 0.01

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._frozen: dict[str, tuple[float, set[str]]] = {}
        self._stop_by: dict[str, float] = {}
        """Robots that have to be stopped, and until when."""

    @property
    def published(self) -> Handlers:
        return {DriveFeedback: self._feedback}

    def lived(self, name: str, what: str) -> None:
        gateway = self.facts.world.bundle.gateways.get(name.partition("/")[2])
        if not name.startswith("gateway/") or gateway is None:
            return
        if what == "frozen":
            on = {r for r in gateway.robots if (f := self.facts.feedback.get(r)) is not None and f.enabled}
            self._frozen.setdefault(name, (self.facts.now, on))
            return
        since, on = self._frozen.pop(name, (inf, set()))
        for robot in gateway.robots:
            self._stop_by.pop(robot, None)
        late_s = self.facts.now - since - gateway.cycle_s
        if what == "thawed" and late_s > gateway.overrun_limit_s + self._MORE_S:
            self._stop_by |= dict.fromkeys(on, self.facts.now + self._WITHIN_S)

    def _feedback(self, name: str, feedback: DriveFeedback) -> None:
        stop_by = self._stop_by.get(feedback.robot, inf)
        if not feedback.enabled:
            self._stop_by.pop(feedback.robot, None)
        elif self.facts.now > stop_by:
            self.broken(name, f"{feedback.robot} is driven on after a cycle that came far too late")


class MovesByOrder(Invariant):
    """After its drives were off, or stood in a fault, a robot begins to move only after an operator's call."""

    name = "nothing moves by itself"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._ordered = dict.fromkeys(facts.robots, False)
        self._enabled = dict.fromkeys(facts.robots, False)
        self._enable_asked = dict.fromkeys(facts.robots, False)
        self._commanded: dict[str, Floats] = {}

    @property
    def published(self) -> Handlers:
        return {DriveFeedback: self._feedback}

    @property
    def delivered(self) -> Handlers:
        return {Request: self._call}

    def _call(self, name: str, request: Request) -> None:
        role, _, robot = name.partition("/")
        if role != "robot" or not isinstance(request.call, Call):
            return
        if isinstance(request.call.command, _MOVES):
            self._ordered[robot] = True
        if isinstance(request.call.command, Enable):
            self._enable_asked[robot] = True

    def _feedback(self, _: str, feedback: DriveFeedback) -> None:
        robot = feedback.robot
        if not feedback.enabled:
            self._ordered[robot] = False
            if self._enabled[robot]:
                self._enable_asked[robot] = False
        elif not self._enabled[robot] and not self._enable_asked[robot]:
            self.broken(robot, "its drives came on, and no operator asked for it")
        before = self._commanded.get(robot)
        moved = before is not None and np.abs(before - feedback.commanded).max() > _JOINING
        if moved and feedback.enabled and self._enabled[robot] and not self._ordered[robot]:
            self.broken(robot, "it moves, and no operator has told it to since its drives were off")
        self._commanded[robot] = feedback.commanded
        self._enabled[robot] = feedback.enabled


class StandsWithoutTorque(Invariant):
    """A robot whose drives are off or stopped comes to rest, and stays there."""

    name = "stands once it is stopped"
    _BRAKING_S = 1.5

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._off_since: dict[str, float] = {}

    @property
    def published(self) -> Handlers:
        return {DriveFeedback: self._feedback}

    def _feedback(self, _: str, feedback: DriveFeedback) -> None:
        if feedback.enabled:
            self._off_since.pop(feedback.robot, None)
        else:
            self._off_since.setdefault(feedback.robot, self.facts.now)

    def look(self, sample: Sample) -> None:
        since = self._off_since.get(sample.robot, inf)
        if sample.at < self.facts.slips_until.get(sample.robot, 0.0):
            return
        if sample.moving and sample.at - since > self._BRAKING_S:
            self.broken(sample.robot, f"it moves {sample.at - since:.2f} s after its drives were stopped", sample.at)


class StopsEndAtRest(Invariant):
    """A gateway that has stopped a robot calls it stopped when it stands, and takes an acknowledgement only then. A
    drive that is off the bus counts as moving until it must have missed its gateway."""

    name = "a stop ends at rest"
    _WITHIN_S = 0.3
    _MEASURED_S = 0.05
    """What the drive said just before it was off the bus may have been its rest."""
    _SETTLES_S = 0.1
    """So long a simulated drive may settle once its node is back on the bus."""

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._states: dict[str, tuple[str, PlayoutState]] = {}
        self._ended: dict[str, float] = {}
        self._asked: dict[str, str] = {}
        """Robots that move while their fault is to be acknowledged, by calls; it may take a while."""

    @property
    def delivered(self) -> Handlers:
        return {Request: self._call}

    @property
    def published(self) -> Handlers:
        return {DriveFeedback: self._feedback, Reply: self._reply}

    def _call(self, _: str, request: Request) -> None:
        call = request.call
        command = call.command if isinstance(call, Call) else None
        if not (isinstance(call, Call) and isinstance(command, ResetDrives)):
            return
        feedback = self.facts.feedback.get(command.robot)
        in_fault = feedback is not None and feedback.state is PlayoutState.FAULT
        if in_fault and self.facts.creeping(command.robot):
            self._asked[call.id] = command.robot

    def _reply(self, name: str, reply: Reply) -> None:
        robot = self._asked.pop(reply.id, None)
        feedback = None if robot is None else self.facts.feedback.get(robot)
        if robot is None or not reply.ok or feedback is None or feedback.enabled:
            return
        if name == self.facts.gateway_of(robot) and self.facts.creeping(robot):
            self.broken(name, f"it has acknowledged a fault of {robot}, which moves")

    def _feedback(self, name: str, feedback: DriveFeedback) -> None:
        boot, before = self._states.get(feedback.robot, (feedback.boot, feedback.state))
        self._states[feedback.robot] = feedback.boot, feedback.state
        if boot == feedback.boot and before is PlayoutState.STOPPING and feedback.state is not before:
            self._ended[feedback.robot] = self.facts.now
            self._all_know(name, feedback.robot)

    def _all_know(self, name: str, robot: str) -> None:
        since, until = self.facts.silenced.get(robot, (inf, inf))
        silent_s = self.facts.now - since
        missed_s = self.facts.world.bundle.gateways[name.partition("/")[2]].heartbeat_timeout_s
        if self.facts.now < until and self._MEASURED_S < silent_s < missed_s:
            what = f"it calls {robot} stopped, one of whose drives has been off the bus for {silent_s:.2f} s"
            self.broken(name, f"{what}, and misses its gateway only after {missed_s:.2f} s")

    def look(self, sample: Sample) -> None:
        since_s = sample.at - self._ended.get(sample.robot, inf)
        _, back_at = self.facts.silenced.get(sample.robot, (inf, inf))
        pushed = sample.at < self.facts.slips_until.get(sample.robot, 0.0)
        if pushed or 0.0 <= sample.at - back_at < self._SETTLES_S:
            return
        if sample.moving and SAMPLE_S < since_s < self._WITHIN_S:
            self.broken(sample.robot, "it moves, and its gateway has said that its stop has ended", sample.at)


class BlocksKeepComing(Invariant):
    """An agent that hears its robot's drives, which are on, supplies them with blocks."""

    name = "blocks keep coming"
    _GAP_S = 0.3

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._since: dict[str, float] = {}

    @property
    def published(self) -> Handlers:
        return {RobotState: self._state, SetpointBlock: self._block}

    def lived(self, name: str, _: str) -> None:
        self._since.pop(name.partition("/")[2], None)

    def _block(self, _: str, block: SetpointBlock) -> None:
        self._since[block.robot] = self.facts.now

    def _state(self, name: str, state: RobotState) -> None:
        robot, facts = state.robot, self.facts
        told = facts.told[name]
        heard = facts.now - told.feedback_at < 0.06
        if not heard or state.mode in (Mode.STARTING, Mode.FAULT, Mode.ESTOP, Mode.DISABLED, Mode.ENABLING):
            self._since.pop(robot, None)
            return
        silent_s = facts.now - self._since.setdefault(robot, facts.now)
        if silent_s > self._GAP_S:
            self.broken(robot, f"{state.mode.value}, and it sent no block for {silent_s:.2f} s")


class HaltsEnd(Invariant):
    """The blocks of a robot that is halted end when the first of them does, or a softer ramp along the path; what its
    drives do meanwhile says less, for it may end by itself."""

    name = "a halt ends at rest"
    _SOFTER_S = 0.4

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._ends: dict[str, tuple[int, int]] = {}
        """Owner, and the tick at which the first block of a halted robot rests."""
        self._late: dict[str, str] = {}
        """What is wrong, unless the robot is told in the same step to have gone on."""

    @property
    def published(self) -> Handlers:
        return {RobotState: self._state, SetpointBlock: self._block}

    def _block(self, _: str, block: SetpointBlock) -> None:
        robot, row = block.robot, rest_row(block)
        state = self.facts.states.get(robot)
        if state is None or state.mode is not Mode.HALTED or row == 0:
            return
        rests_at = block.first_tick + row
        owner, first = self._ends.get(robot, (block.owner, rests_at))
        if owner != block.owner:
            first = rests_at
        self._ends[robot] = block.owner, first
        late_s = (rests_at - first) * block.dt_s
        if late_s > self._SOFTER_S:
            self._late[robot] = f"it is halted, and a block leads {late_s:.2f} s beyond the end of its halt"

    def _state(self, _: str, state: RobotState) -> None:
        late = self._late.pop(state.robot, "")
        if state.mode is not Mode.HALTED:
            self._ends.pop(state.robot, None)
        elif late:
            self.broken(state.robot, late)


class BlocksEndAtRest(Invariant):
    """Every block is a motion to standstill."""

    name = "a block ends at rest"

    @property
    def published(self) -> Handlers:
        return {SetpointBlock: self._block}

    def _block(self, _: str, block: SetpointBlock) -> None:
        if np.abs(block.velocity[-1]).max() > 0.0:
            self.broken(block.robot, f"block {block.sequence} ends with velocity {block.velocity[-1]}")


class BlocksAreTaken(Invariant):
    """While nothing disturbs them, a gateway takes the blocks of its owner."""

    name = "blocks are taken"
    _LOOK_S = 1.0
    _SHARE = 0.5

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._since: dict[str, tuple[float, int, int]] = {}
        self._sent = dict.fromkeys(facts.robots, 0)

    @property
    def published(self) -> Handlers:
        return {SetpointBlock: self._block, DriveFeedback: self._feedback}

    def _block(self, _: str, block: SetpointBlock) -> None:
        self._sent[block.robot] += 1

    def _feedback(self, name: str, feedback: DriveFeedback) -> None:
        robot, facts = feedback.robot, self.facts
        if not feedback.enabled or not facts.calm(1.0) or facts.world.network.weather.loss > 0.06:
            self._since.pop(robot, None)
            return
        since, refused, sent = self._since.setdefault(robot, (facts.now, feedback.refused, self._sent[robot]))
        if facts.now - since < self._LOOK_S:
            return
        self._since.pop(robot)
        new, of = feedback.refused - refused, self._sent[robot] - sent
        if of > 20 and new > self._SHARE * of:
            self.broken(name, f"{new} of {of} blocks of {robot} were refused within {self._LOOK_S:g} s")
