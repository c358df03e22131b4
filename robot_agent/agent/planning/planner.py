"""From steps of a program to a planned motion with its swept body. Runs in a worker; pure, so tests call it too."""

from contextlib import suppress
from copy import copy
from dataclasses import replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from cell.geometry import pose_from, transform_points
from cell.messages import FramePose, ZoneGeometry
from robot_agent.agent.parameters import AS_FILED
from robot_agent.agent.planning.plans import Extended, ExtendRequest, PlanFailed, Planned, PlanRequest
from robot_agent.agent.planning.reading import tolerance_of
from robot_agent.agent.planning.targets import NoPlace, Targets
from robot_agent.kinematics import KinematicsError
from robot_agent.language import JointStep, LineStep, Mark, MotionStep, SplineStep, Switch, TcpStep
from robot_agent.model.description import Mounted
from robot_agent.paths import Arc, JointMove, Line, Move, PathError, Sequence, Spline
from robot_agent.paths.arc import evenly_turned
from robot_agent.paths.legs import end_of, half_turns
from robot_agent.trajectory import Motion, PlanError, plan, spliced, tau_before
from robot_agent.workspace import (
    Braking,
    Breach,
    Crossing,
    MotionSections,
    PlacedRobot,
    Touch,
    crossings,
    cut,
    extended,
    sweep,
)

ZONE_MARGIN_M = 0.03
"""A robot stops this far in front of a zone it may not enter: more than the growth of a published body."""

_SLOWINGS = 6
"""So often a motion is planned with lower caps on moves whose TCP is too fast in a slow space."""
_BELOW = 0.97
"""Share of the allowed speed that is aimed at, for what the timing makes of it."""
_SLOWEST = 1e-4
"""[m/s, rad/s] of a cap."""


class Planner:
    """Plans the steps of one robot, with what its gateway tells when it gives the robot.

    `cycle_s` is the gateway's cycle, and `quick_stop` with what each axis brakes by itself [rad/s^2 or m/s^2]; empty:
    with what the ramps need.
    """

    def __init__(self, robot: PlacedRobot, cycle_s: float, quick_stop: tuple[float, ...] = ()) -> None:
        self.model = robot.model
        self.limits = robot.limits
        self.pose_world_base = robot.pose_world_base
        self.things = robot.things
        self.spaces = robot.spaces
        self.cycle_s = cycle_s
        self.quick_stop = quick_stop
        self.targets = Targets(robot.model, robot.pose_world_base)
        self._kept_apart = robot.kept_apart
        self._braking = Braking.of(robot.model, robot.limits, cycle_s, quick_stop)
        self.mounted = robot.model.description.mounted
        """In all that it plans."""
        self._mountings = {self.mounted: self}
        for mounted, other in robot.mountings.items():
            self._mountings[mounted] = Planner(other, cycle_s, quick_stop)
            self._mountings[mounted]._mountings = self._mountings

    def mounting(self, mounted: Mounted) -> "Planner":
        """The planner of the same robot with this tool and part, or with any of them, or without."""
        return self._mountings[mounted]

    def place(self, frames: tuple[FramePose, ...]) -> None:
        """Look at things, and at targets in frames, where they are with the frames there."""
        at = {each.frame: pose_from(np.array(each.position_m), np.array(each.quaternion_xyzw)) for each in frames}
        self.things = self.things.placed(at)
        self.targets = replace(self.targets, frames=at)

    def plan(self, request: PlanRequest | ExtendRequest) -> Planned | PlanFailed:
        """Plan steps with what is mounted then; every failure is a `PlanFailed` that says where and why."""
        planner = self.mounting(request.mounted)
        planner.place(request.frames)
        if request.tuning != AS_FILED:
            planner = copy(planner)
            planner.limits = request.tuning.within(planner.limits)
        try:
            sequence, pose = planner._sequence(request)
            result = planner._slowed(request, sequence)
            aside = tolerance_of(request.steps[-1]) is not None
            return replace(result, aimed=pose) if aside and isinstance(result, Planned) else result
        except PlanError as error:
            return PlanFailed(request.id, error.line, str(error), error.move)
        except KinematicsError as error:
            return PlanFailed(request.id, request.line, f"line {request.line}: {error}")

    def _slowed(self, request: PlanRequest | ExtendRequest, sequence: Sequence) -> Planned | PlanFailed:
        """The motion, each of its moves so slow that the TCP keeps the speed of the slow spaces that it is in."""
        line, step, worst = 0, 0, 0.0
        for _ in range(_SLOWINGS):
            planned = self._planned(request, sequence)
            if not self.spaces.slow or isinstance(planned, PlanFailed):
                return planned
            motion, taus = planned.motion, planned.taus
            haste = self.spaces.haste(self.pose_world_base, motion.q(taus), motion.qd(taus), planned.spaces_off)
            number = motion.move_at(taus) - (len(motion.ends) - len(sequence))
            hasty = (haste > 1.0) & (number >= 0)
            if not hasty.any():
                return planned
            line, worst = planned.line_at(float(taus[haste.argmax()])), float(haste.max())
            step = max(int(number[haste.argmax()]), 0)
            moves = list(sequence.moves)
            for k in np.unique(number[hasty]):
                there = hasty & (number == k)
                moves[k] = self._slower(moves[k], motion.q(taus[there]), motion.qd(taus[there]), haste[there])
            sequence = Sequence(moves, sequence.beyond, sequence.aimed)
        text = (
            f"line {line}: the TCP is {100.0 * (worst - 1.0):.0f} % too fast in a slow space, whatever the move's speed"
        )
        return PlanFailed(request.id, line, f"{text}: name a lower F, or go around the space", step)

    def _slower(self, move: Move, q: NDArray[np.float64], qd: NDArray[np.float64], haste: NDArray[np.float64]) -> Move:
        """A move with lower caps: on what the TCP does at samples `(k, n)` where it is too fast by `haste`."""
        twist = (self.model.jacobian(q) @ qd[..., None])[..., 0] * (_BELOW / haste[:, None])
        speed, turn = (float(np.linalg.norm(part, axis=-1).max()) for part in np.split(twist, 2, axis=-1))
        speeds = [max(speed, _SLOWEST), *([] if move.speed_m_s is None else [move.speed_m_s])]
        turns = [max(turn, _SLOWEST), *([] if move.rotation_rad_s is None else [move.rotation_rad_s])]
        return replace(move, speed_m_s=min(speeds), rotation_rad_s=min(turns))

    def _planned(self, request: PlanRequest | ExtendRequest, sequence: Sequence) -> Planned | PlanFailed:
        if isinstance(request, ExtendRequest):
            return self._free(self._extended(request, sequence), len(sequence), request.splice_s - request.cut_s)
        motion = plan(self.model, sequence, self.limits, start=request.start, cycle_s=self.cycle_s)
        planned = self._with_body(request.id, _lines(sequence), motion, request.zones)
        switches = _switches(request)
        planned = replace(
            planned, switches=switches, places=_places(motion, switches), spaces_off=request.steps[0].spaces_off
        )
        return self._free(planned, len(sequence))

    def _extended(self, request: ExtendRequest, sequence: Sequence) -> Extended:
        old, at_s, cut_s = request.motion, request.splice_s, request.cut_s
        onward = plan(self.model, sequence, self.limits, start=old.state(at_s), cycle_s=self.cycle_s)
        motion = spliced(old, at_s, onward, cut_s)
        moves = len(motion.ends)
        lines = (request.lines + _lines(sequence))[-moves:]
        whole = self._with_body(request.id, lines, motion, request.zones)
        switches = (request.switches + _switches(request))[-moves:]
        return Extended(
            whole.id, lines, motion, whole.taus, whole.sweep, whole.crossings, whole.zone_versions,
            first_tau=self.cycle_s if cut_s > 0.0 else request.first_tau, cut_s=cut_s, splice_s=at_s - cut_s,
            switches=switches, places=_places(motion, switches), spaces_off=request.steps[0].spaces_off,
            mounted=whole.mounted, shut=whole.shut, sections=self._extended_sections(request, whole),
        )  # fmt: skip

    def _extended_sections(self, request: ExtendRequest, whole: Planned) -> MotionSections | None:
        """Those of the motion before, up to where it is extended, and new ones from there on."""
        if request.sections is None:
            return whole.sections
        samples = whole.sweep, whole.taus, whole.motion.q(whole.taus), whole.motion.qd(whole.taus)
        return extended(request.sections, request.cut_s, request.splice_s - request.cut_s, self._braking, *samples)

    def _free(self, planned: Planned, steps: int, from_tau: float = 0.0) -> Planned | PlanFailed:
        """The motion, if from this tau [s] on it touches nothing that it must not, and keeps to its spaces.

        Its last moves are the `steps` that were asked for.
        """
        if not (self.things or self.spaces):
            return planned
        first = max(int(np.searchsorted(planned.taus, from_tau, side="right")) - 1, 0)
        taus, motion = planned.taus[first:], planned.motion
        onward = planned.sweep.part(first, len(planned.taus) - 1)

        def points_at(times: NDArray[np.float64]) -> NDArray[np.float64]:
            return transform_points(self.pose_world_base, self.model.capsules(motion.q(times)))

        def watched_at(times: NDArray[np.float64]) -> NDArray[np.float64]:
            return self.spaces.points(self.pose_world_base, motion.q(times))

        found: list[Touch | Breach | None] = [self.things.first_touch(onward, taus, points_at)]
        if self.spaces:
            watched = self.spaces.watched(onward, self.pose_world_base, self.model.forward(motion.q(taus)))
            found.append(
                self.spaces.first_breach(watched, taus, watched_at, planned.spaces_off.union(self.spaces.inputs))
            )
        touch = min((each for each in found if each is not None), key=lambda each: each.tau, default=None)
        return planned if touch is None else self._refused(planned, touch, taus, steps)

    def _refused(self, planned: Planned, touch: Touch | Breach, taus: NDArray[np.float64], steps: int) -> PlanFailed:
        """What a motion runs into, where, and how far it is free."""
        line, before = planned.line_at(touch.tau), taus[taus < touch.tau]
        free = "not even where it begins"
        if len(before):
            free = f"free up to {self._joints(planned.motion.q(before[-1:])[0])}"
        step = int(planned.motion.move_at(np.array(touch.tau))) - (len(planned.lines) - steps)
        text = f"line {line}: {touch}, {touch.tau:.2f} s after the motion begins; {free}"
        return PlanFailed(planned.id, line, text, max(step, 0))

    def _joints(self, q: NDArray[np.float64]) -> str:
        """For people, as in a program."""
        shown = np.where(self.model.linear, 1000.0 * q, np.degrees(q))
        return " ".join(f"{name}={value:.4g}" for name, value in zip(self.model.joint_names, shown, strict=True))

    def half_turns(self, request: PlanRequest | ExtendRequest) -> set[int]:
        """Program lines of the request on which the tool makes half a turn at once, whose two ways are as long."""
        planner = self.mounting(request.mounted)
        numbered = list(enumerate(planner._sequence(request)[0].moves))
        lines, q = set[int](), request.start
        for joints, group in groupby(numbered, key=lambda each: isinstance(each[1], JointMove)):
            moves = list(group)
            if joints:
                q = next(move.target for _, move in reversed(moves) if isinstance(move, JointMove))
                continue
            try:
                found = half_turns([(k, b) for k, b in moves if not isinstance(b, JointMove)], planner.model.forward(q))
            except PathError:
                continue  # planning names what is wrong
            lines |= {request.steps[move].line for move in found}
        return lines

    def standstill(self, q: NDArray[np.float64], zones: tuple[ZoneGeometry, ...]) -> Planned:
        """The motion of a robot that stands at `q` `(n,)`."""
        motion = plan(self.model, Sequence([JointMove(q, 1.0, 0)]), self.limits, start=q, cycle_s=self.cycle_s)
        return self._with_body(0, (0,), motion, zones)

    def sampled(self, motion: Motion) -> Planned:
        """A motion given by a source, with its body; zones are looked at where its samples are made."""
        taus = motion.grid
        return Planned(0, (0,), motion, taus, sweep(self.model, self.pose_world_base, motion.q(taus)), (), {})

    def _sequence(self, request: PlanRequest | ExtendRequest) -> tuple[Sequence, NDArray[np.float64]]:
        """The steps with every value that they leave to where the robot comes from; the pose that they lead to."""
        q = request.start
        pose = self.model.forward(q) if request.aimed is None else request.aimed
        moves, q, pose = self._moves(request.steps, q, pose)
        beyond: list[Move] = []
        with suppress(PlanError):
            beyond = self._moves(request.beyond, q, pose)[0]
        return Sequence(moves, beyond, request.aimed), pose

    def _moves(
        self, steps: tuple[MotionStep, ...], q: NDArray[np.float64], pose: NDArray[np.float64]
    ) -> tuple[list[Move], NDArray[np.float64], NDArray[np.float64]]:
        """Steps from joints `q` `(n,)` and pose `(4, 4)` of the TCP as moves; joints and pose after them."""
        moves: list[Move] = []
        for step in steps:
            try:
                if isinstance(step, JointStep):
                    q = self.targets.joints(step, q)
                    moves.append(_joint_move(step, q))
                    pose = self.model.forward(q) if len(q) == self.model.n else pose
                else:
                    move = _tcp_move(step, pose, self.targets)
                    moves.append(move)
                    pose = end_of(move, pose)
            except NoPlace as error:
                raise PlanError(len(moves), step.line, str(error), error.remedy) from error
        return moves, q, pose

    def _with_body(self, id: int, lines: tuple[int, ...], motion: Motion, zones: tuple[ZoneGeometry, ...]) -> Planned:
        taus = motion.grid
        body = sweep(self.model, self.pose_world_base, motion.q(taus))
        crossed = tuple(c for zone in zones for c in crossings(body, taus, zone, ZONE_MARGIN_M))
        versions = {zone.zone: zone.version for zone in zones}
        shut: tuple[Crossing, ...] = ()
        if self.spaces.inputs:
            watched = self.spaces.watched(body, self.pose_world_base, self.model.forward(motion.q(taus)))
            shut = self.spaces.switched_by_input(watched, taus)
        sections = cut(self._braking, body, taus, motion.q(taus), motion.qd(taus)) if self._kept_apart else None
        return Planned(
            id, lines, motion, taus, body, crossed, versions, mounted=self.mounted, shut=shut, sections=sections
        )


def _lines(sequence: Sequence) -> tuple[int, ...]:
    return tuple(move.line for move in sequence.moves)


def _switches(request: PlanRequest | ExtendRequest) -> tuple[tuple[Mark, ...], ...]:
    return tuple(step.switches for step in request.steps)


def _places(motion: Motion, switches: tuple[tuple[Mark, ...], ...]) -> tuple[tuple[float, Mark], ...]:
    """Where on a motion its marks are; none lies in front of the one before it, nor of its own move."""
    places: list[tuple[float, Mark]] = []
    for move, marks in enumerate(switches):
        begin, end = 0.0 if move == 0 else float(motion.ends[move - 1]), float(motion.ends[move])
        for mark in marks:
            before = mark.before if isinstance(mark, Switch) else None
            if before is None:
                tau = end
            elif before.way_m > 0.0:
                tau = tau_before(motion, move, before.way_m)
            else:
                tau = max(end - before.time_s, begin)
            places.append((max([tau, *(at for at, _ in places[-1:])]), mark))
    return tuple(places)


def _joint_move(step: JointStep, target: NDArray[np.float64]) -> JointMove:
    pace = step.pace
    return JointMove(
        target,
        step.speed,
        step.line,
        synchronised=step.synchronised,
        speed_m_s=pace.speed_m_s,
        rotation_rad_s=pace.rotation_rad_s,
        joint_speed_rad_s=pace.joint_speed_rad_s,
        round_m=pace.round_m,
    )


def _tcp_move(step: TcpStep, present: NDArray[np.float64], targets: Targets) -> Line | Arc | Spline:
    target = targets.pose(step.position_m, step.orientation_abc, step.aim, present)
    if step.tangential_rad is not None:
        target[:3, :3] = present[:3, :3]
    move: Line | Arc | Spline
    if isinstance(step, LineStep):
        move = Line(target, step.pace.speed_m_s, step.line, step.wrist_may_flip)
    elif isinstance(step, SplineStep):
        move = Spline(target[None], step.line, step.pace.speed_m_s)
    else:
        via = targets.pose(step.via_position_m, step.via_orientation_abc, step.via_aim, present)
        if step.via_orientation_abc is None and not step.via_aim.joints:
            via = evenly_turned(present, via, target)
        move = Arc(via, target, step.line, step.angle_rad, step.pace.speed_m_s, step.lift_m)
    return replace(
        move,
        rotation_rad_s=step.pace.rotation_rad_s,
        joint_speed_rad_s=step.pace.joint_speed_rad_s,
        round_m=step.pace.round_m,
        tangential_rad=step.tangential_rad,
        tolerance=tolerance_of(step),
    )
