"""What processes say of themselves and of others, against what is the case."""

from math import inf

import numpy as np

from cell.config.settings import OnManagerReturn
from cell.core import Request
from cell.messages import (
    Call,
    Continue,
    DriveFeedback,
    Enable,
    Jog,
    JogHeld,
    ManagerState,
    Mode,
    ProgramState,
    ResetRobot,
    Return,
    RobotState,
    Run,
    SetpointBlock,
    Step,
    ZoneState,
)
from tests.sim.judge.facts import Facts, Floats, Sample, rest_row
from tests.sim.judge.invariant import Handlers, Invariant

_CAUSES: dict[Mode, tuple[type, ...]] = {
    Mode.RUNNING: (Run, Continue, Step),
    Mode.RETURNING: (Return, Continue, Step),
    Mode.JOGGING: (Jog,),
    Mode.ENABLING: (Enable,),
}
"""What an operator must have asked for before a robot comes to a mode."""
_FROM_ITSELF = {(Mode.RETURNING, Mode.RUNNING)}
_WAYS_OUT: dict[Mode, frozenset[Mode]] = {
    Mode.FAULT: frozenset({Mode.DISABLED, Mode.ESTOP, Mode.READY, Mode.HALTED, Mode.OFF_PATH}),
    Mode.ESTOP: frozenset(
        {Mode.DISABLED, Mode.FAULT, Mode.STARTING, Mode.READY, Mode.HALTED, Mode.OFF_PATH, Mode.ENABLING}
    ),
    Mode.DISABLED: frozenset(set(Mode) - {Mode.RUNNING, Mode.RETURNING, Mode.JOGGING}),
    Mode.STARTING: frozenset(set(Mode) - {Mode.RUNNING, Mode.RETURNING, Mode.JOGGING}),
}
_STILL = (Mode.READY, Mode.HALTED, Mode.OFF_PATH, Mode.DISABLED, Mode.FAULT, Mode.ESTOP, Mode.ENABLING)
_ON = (Mode.READY, Mode.RUNNING, Mode.HALTED, Mode.OFF_PATH, Mode.RETURNING, Mode.JOGGING)


class ModesHaveCauses(Invariant):
    """A robot comes to a mode in which it moves, and out of a fault, only by an operator's call that reached it since
    it was in the mode before."""

    name = "modes have causes"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._mode: dict[str, tuple[str, Mode, float]] = {}
        self._stopped_at: dict[str, float] = {}
        """Since when a robot is in a fault or an emergency stop, one after the other: a reset may take so long."""

    @property
    def published(self) -> Handlers:
        return {RobotState: self._state}

    def _state(self, name: str, state: RobotState) -> None:
        boot, before, since = self._mode.get(state.robot, (state.boot, Mode.STARTING, self.facts.now))
        if before not in (Mode.FAULT, Mode.ESTOP):
            self._stopped_at[state.robot] = self.facts.now
        if boot != state.boot:
            before, since = Mode.STARTING, self.facts.now - 1.0
        if state.mode is before and boot == state.boot:
            self._mode[state.robot] = boot, before, since
            return
        self._mode[state.robot] = state.boot, state.mode, self.facts.now
        calls = {type(call.command) for at, call in self.facts.told[name].calls if at >= since - 0.1}
        way = f"from {before.value} to {state.mode.value}"
        if before is Mode.DISABLED and self._has_torque(state.robot):
            before = Mode.READY  # or halted, or off its path, within this step
        if before in _WAYS_OUT and state.mode not in _WAYS_OUT[before]:
            self.broken(state.robot, f"it went {way}")
        stopped_at = self._stopped_at[state.robot]
        acknowledged = any(
            at >= stopped_at - 0.1 and isinstance(call.command, ResetRobot) for at, call in self.facts.told[name].calls
        )
        if before is Mode.FAULT and state.mode is not Mode.ESTOP and not acknowledged:
            self.broken(state.robot, f"it went {way}, and nobody has acknowledged the fault")
        causes = _CAUSES.get(state.mode, ())
        if causes and (before, state.mode) not in _FROM_ITSELF and not calls & set(causes):
            self.broken(state.robot, f"it went {way}, and no operator asked for that")

    def _has_torque(self, robot: str) -> bool:
        feedback = self.facts.feedback.get(robot)
        return feedback is not None and feedback.enabled


class OperatorDecides(Invariant):
    """In a cell in which an operator decides after a silence of the manager, a robot that does not hear the manager is
    halted."""

    name = "halted where an operator decides"
    _WITHIN_S = 0.1

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._since: dict[str, float] = {}

    @property
    def published(self) -> Handlers:
        return {RobotState: self._state}

    def _state(self, name: str, state: RobotState) -> None:
        facts, robot = self.facts, state.robot
        decides = facts.cell.on_manager_return is OnManagerReturn.OPERATOR
        shown, feedback = facts.shown.get(robot), facts.feedback.get(robot)
        owns = shown is not None and feedback is not None and feedback.owner == shown.message.owner
        heard = owns and facts.now - facts.told[name].feedback_at < 0.06
        if not decides or not heard or facts.manager_fresh(robot) or state.mode not in (Mode.RUNNING, Mode.RETURNING):
            self._since.pop(robot, None)
            return
        silent_s = facts.now - self._since.setdefault(robot, facts.now)
        if silent_s > self._WITHIN_S:
            self.broken(robot, f"it is {state.mode.value}, and has not heard the manager for {silent_s:.2f} s")


class ModeIsTheCase(Invariant):
    """A robot whose mode says that it stands, stands once it had the time to rest that it told when it came there; one
    whose drives stop it off its path after a while that they alone know."""

    name = "the mode is what is the case"
    _LONGEST_S = 2.0
    _LATER_S = 0.4
    """The block on its way is played first, and a ramp along the path may be softer than the one of a block."""

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._began: dict[str, tuple[float, float]] = {}
        """Since when a robot has been in its mode, and the time to rest that it told then [s]."""

    def look(self, sample: Sample) -> None:
        since, told_s = self._began.get(sample.robot, (-inf, 0.0))
        if since != sample.mode_since:
            drives_stop_it = sample.mode in (Mode.FAULT, Mode.ESTOP) or self.facts.hindered(sample.robot, sample.at)
            told = None if drives_stop_it else sample.shown
            told_s = inf if told is None else told.message.stop_time_s
            since, told_s = self._began[sample.robot] = sample.mode_since, told_s
        since_s = sample.at - since
        if sample.at < self.facts.slips_until.get(sample.robot, 0.0):
            return
        if sample.mode in _STILL and sample.moving and since_s > min(self._LONGEST_S, told_s + self._LATER_S):
            self.broken(sample.robot, f"it moves, and has been {sample.mode.value} for {since_s:.2f} s", sample.at)


class SaysWhyItStands(Invariant):
    """A robot whose program runs and that does not move says why; and names the holder of a zone that it waits for."""

    name = "says why it stands"
    _LONGEST_S = 1.0
    _CALM_S = 0.5
    """What a link that fails does to its blocks a robot need not know."""

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._since: dict[str, float] = {}

    @property
    def published(self) -> Handlers:
        return {RobotState: self._state}

    def _state(self, name: str, state: RobotState) -> None:
        robot, facts = state.robot, self.facts
        shown = facts.shown.get(robot)
        if shown is not None and shown.at == facts.now and tuple(sorted(shown.message.holds)) != state.zones:
            self.broken(robot, f"its state says that it holds {state.zones}, its presence {shown.message.holds}")
        self._names_the_holder(name, state)
        runs = state.mode is Mode.RUNNING and state.program.state is ProgramState.RUNNING and facts.calm(self._CALM_S)
        stands = not facts.moving(robot) and not facts.creeping(robot)
        if not runs or state.waiting_for or not stands or facts.now - facts.told[name].feedback_at > 0.1:
            self._since.pop(robot, None)
        elif facts.now - self._since.setdefault(robot, facts.now) > self._LONGEST_S:
            self.broken(robot, f"its program runs, it has stood for {self._LONGEST_S:g} s and does not say why")

    def _names_the_holder(self, name: str, state: RobotState) -> None:
        zone, _, rest = state.waiting_for.removeprefix("zone ").partition(": held by ")
        manager = self.facts.told[name].manager
        if not rest or not state.waiting_for.startswith("zone ") or manager is None or zone not in manager.zones:
            return
        holder = manager.zones[zone].holder
        if rest.split()[0] != holder:
            self.broken(state.robot, f"it says {state.waiting_for!r}, and the manager told it that {holder} holds it")


class FeedbackIsNeeded(Invariant):
    """An agent that does not hear its robot's drives sends nothing new, and calls it a fault in time."""

    name = "nothing new without feedback"

    @property
    def published(self) -> Handlers:
        return {SetpointBlock: self._block, RobotState: self._state}

    def _silent_s(self, robot: str) -> float:
        told = self.facts.told[f"robot/{robot}"]
        return self.facts.now - max(told.feedback_at, told.since)

    def _block(self, _: str, block: SetpointBlock) -> None:
        times, cycle_s = self.facts.cell.times, self.facts.world.cycle_s(block.robot)
        silent_s = self._silent_s(block.robot)
        if rest_row(block) > 0 and silent_s > max(5 * cycle_s, times.lead_s) + 0.03:
            self.broken(block.robot, f"block {block.sequence} moves it, its drives were heard {silent_s:.3f} s ago")

    def _state(self, _: str, state: RobotState) -> None:
        silent_s, lost_s = self._silent_s(state.robot), self.facts.cell.times.feedback_lost_s
        if state.mode in _ON and silent_s > lost_s + 0.05:
            self.broken(state.robot, f"it is {state.mode.value}, its drives were heard {silent_s:.3f} s ago")


class FaultyDrivesStop(Invariant):
    """A robot of which a drive is in a fault, is off the bus, or does not go where it is told, is not driven on."""

    name = "no drive is left alone"
    _LONGEST_S = 0.15
    _BESIDE = 1.5
    """So many following windows."""
    _BESIDE_S = 0.25
    """Longer than the time that the drives file allows, and the lateness that it allows a cycle."""

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._since: dict[str, float] = {}
        self._beside_since: dict[str, float] = {}
        self._thawed_at: dict[str, float] = {}
        self._windows = {robot: self._windows_of(robot) for robot in facts.robots}

    def _windows_of(self, robot: str) -> Floats:
        """The following windows of its axes, `(n,)` [rad or m]."""
        gateway = self.facts.world.bundle.gateways[self.facts.cell.robots[robot].gateway]
        return np.array([axis.following_window for axis in gateway.robots[robot].axes])

    def lived(self, name: str, what: str) -> None:
        if what == "thawed":
            self._thawed_at[name] = self.facts.now

    @property
    def published(self) -> Handlers:
        return {DriveFeedback: self._feedback}

    def _feedback(self, name: str, feedback: DriveFeedback) -> None:
        bad = [axis.name for axis in feedback.axes if axis.name in ("SILENT", "FAULT", "FAULT_REACTION_ACTIVE")]
        if not bad or not feedback.enabled:
            self._since.pop(feedback.robot, None)
        elif self.facts.now - self._since.setdefault(feedback.robot, self.facts.now) > self._LONGEST_S:
            self.broken(name, f"{feedback.robot} is driven on although its drives are {', '.join(bad)}")
        self._off_the_bus(name, feedback)
        self._beside(name, feedback)

    def _off_the_bus(self, name: str, feedback: DriveFeedback) -> None:
        facts = self.facts
        since, until = facts.silenced.get(feedback.robot, (inf, inf))
        silent_s = facts.now - max(since, facts.told[name].since, self._thawed_at.get(name, -inf))
        allowed_s = facts.world.bundle.gateways[name.partition("/")[2]].tpdo_timeout_s + self._LONGEST_S
        if feedback.enabled and facts.now < until and silent_s > allowed_s:
            self.broken(name, f"{feedback.robot} is driven on {silent_s:.2f} s after one of its drives was last heard")

    def _beside(self, name: str, feedback: DriveFeedback) -> None:
        robot, facts = feedback.robot, self.facts
        gateway = facts.world.bundle.gateways[name.partition("/")[2]]
        axes = gateway.robots[robot].axes
        allowed_s = gateway.overrun_limit_s + max(axis.following_time_s for axis in axes) + self._BESIDE_S
        # A position answers a sample of some cycles ago: an axis that goes on fast is as far behind the newest one.
        behind = np.abs(feedback.velocity) * [gateway.cycle_s * axis.delay_cycles for axis in axes]
        away = (np.abs(feedback.position - feedback.commanded) - behind) / self._windows[robot]
        if not feedback.enabled or away.max() < self._BESIDE:
            self._beside_since.pop(robot, None)
            return
        beside_s = facts.now - self._beside_since.setdefault(robot, facts.now)
        if beside_s > allowed_s:
            what = f"an axis has been {away.max():.1f} following windows beside its command for {beside_s:.2f} s"
            self.broken(name, f"{robot} is driven on although {what}")


class JogsWhileHeld(Invariant):
    """A robot is jogged only while a key is held, by signs of it that answer a state of less than 0.2 s ago, and
    slowly."""

    name = "jogs while the key is held"
    _HELD_S = 0.2
    _BRAKING_S = 1.0
    _SPEED_M_S = 0.25 * 1.02

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._alive: dict[str, float] = {}

    @property
    def delivered(self) -> Handlers:
        return {JogHeld: self._key, Request: self._call}

    @property
    def published(self) -> Handlers:
        return {RobotState: self._state}

    def _key(self, _: str, key: JogHeld) -> None:
        if key.held:
            self._sign(key.robot, key.heard.boot, key.heard.sequence)

    def _call(self, name: str, request: Request) -> None:
        call = request.call
        if isinstance(call, Call) and isinstance(call.command, Jog) and call.heard is not None:
            self._sign(name.partition("/")[2], call.heard.boot, call.heard.sequence)

    def _sign(self, robot: str, boot: str, sequence: int) -> None:
        at = self.facts.sent.get(("state of " + boot, sequence), 0.0)
        self._alive[robot] = max(self._alive.get(robot, 0.0), at)

    def _state(self, _: str, state: RobotState) -> None:
        if state.mode is not Mode.JOGGING:
            return
        alone_s = self.facts.now - self._alive.get(state.robot, 0.0)
        if alone_s > self._HELD_S + self._BRAKING_S and self.facts.moving(state.robot):
            self.broken(state.robot, f"it is jogged, and no key was held for {alone_s:.2f} s")
        if (state.tcp_speed_m_s or 0.0) > self._SPEED_M_S:
            self.broken(state.robot, f"it is jogged at {state.tcp_speed_m_s:.3f} m/s")


class FreeZonesAreGranted(Invariant):
    """A zone that is free, with nothing against it, is given to whoever waits for it."""

    name = "a free zone is granted"
    _LONGEST_S = 0.3

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._since: dict[str, float] = {}

    @property
    def published(self) -> Handlers:
        return {ManagerState: self._state}

    def lived(self, name: str, _: str) -> None:
        if name == "manager":
            self._since.clear()

    def _state(self, _: str, state: ManagerState) -> None:
        for zone, status in state.zones.items():
            if status.state is not ZoneState.FREE or not status.queue or status.reason:
                self._since.pop(zone, None)
            elif self.facts.now - self._since.setdefault(zone, self.facts.now) > self._LONGEST_S:
                self.broken("manager", f"zone {zone} is free, and {', '.join(status.queue)} waits for it")


class SilentHoldersAreBlocked(Invariant):
    """A zone whose holder is silent is called orphaned."""

    name = "a silent holder's zone is blocked"

    @property
    def published(self) -> Handlers:
        return {ManagerState: self._state}

    def _state(self, _: str, state: ManagerState) -> None:
        for zone, status in state.zones.items():
            if status.state not in (ZoneState.GRANTED, ZoneState.OCCUPIED) or status.holder is None:
                continue
            age_s = self.facts.presence_age(status.holder)
            if age_s > self.facts.cell.times.fresh_s + 0.01:
                what = f"zone {zone} is {status.state.value} by {status.holder}, which was heard {age_s:.3f} s ago"
                self.broken("manager", what)
