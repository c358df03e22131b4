"""Whether a robot reaches what its program says, as far as that can be told before it runs."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cell.geometry.arrays import Array
from robot_agent.agent.planning.targets import NoPlace, Targets
from robot_agent.kinematics import KinematicsError, Model, TrackError, model_of
from robot_agent.kinematics.choice import joint_violation
from robot_agent.kinematics.turns import LIMIT_TOLERANCE_RAD
from robot_agent.language import (
    BASE,
    ArcStep,
    Finished,
    Interpreter,
    JointStep,
    LineStep,
    Mount,
    Program,
    ProgramFault,
    SplineStep,
    TrackingOff,
    Ways,
    mounted_before,
)
from robot_agent.model.description import Mounted
from robot_agent.paths import LineGeometry

MOST_MOTIONS = 2000
MOST_SAMPLES = 10_000
"""Of one line, 50 m: a file with an absurd length must not keep its user waiting."""
STEP_M = 0.005
STEP_RAD = math.radians(1.0)
_Place = tuple[int, Mounted, bytes]


def unreachable_lines(model: Model, program: Program) -> Iterator[tuple[int, str]]:
    """Program lines that lead out of reach or out of the limits, or fail wherever the robot is; each once, and why.

    The program is walked as it would run. Where the robot is before its first motion nobody knows: until the first
    HOME, or MJ that names all joints, and after arcs, splines and TRACK OFF, targets with all six coordinates are
    judged, and others when what they name is farther away than any part of the robot can be. Both ways of each fork
    are gone.
    """
    told, ways, before = set[int](), Ways(), mounted_before(program, model.description)
    for _ in ways.rounds(program.statements):
        walk = _Walk(model)
        for line, why in _round(walk, Interpreter(program, before, ways=ways), len(program.statements)):
            if line not in told:
                told.add(line)
                yield line, why


def _round(walk: "_Walk", interpreter: Interpreter, longest: int) -> Iterator[tuple[int, str]]:
    """What is wrong on the way, until more than `longest` motions in a row are not new."""
    seen, since_new = set[_Place](), 0
    for _ in range(MOST_MOTIONS):
        step = interpreter.next()
        if isinstance(step, ProgramFault):
            yield step.line, step.text
        if isinstance(step, Finished | ProgramFault):
            return
        if isinstance(step, ArcStep | SplineStep | TrackingOff):
            walk.q = None
        if isinstance(step, Mount):
            walk.mount(step)
        if not isinstance(step, JointStep | LineStep):
            continue
        place = step.line, step.mounted, b"" if walk.q is None else np.round(walk.q, 6).tobytes()
        since_new = since_new + 1 if place in seen else 0
        if since_new > longest:
            return
        seen.add(place)
        if place in walk.ends:
            walk.q = walk.ends[place]
            continue
        problem = walk.joints(step) if isinstance(step, JointStep) else walk.line(step)
        walk.ends[place] = walk.q
        if problem:
            yield step.line, problem


class _Walk:
    """One robot on its way through a program."""

    def __init__(self, model: Model) -> None:
        self._model = model
        self._targets = Targets(model)
        self._models = {model.description.mounted: model}
        self.q: Array | None = None
        """Joints, as long as they are known."""
        self.ends: dict[_Place, Array | None] = {}
        """Joints after a step, by its place."""

    def mount(self, step: Mount) -> None:
        """From here on what is said of the TCP is said of another one."""
        if step.mounted not in self._models:
            self._models[step.mounted] = model_of(replace(self._model.description, mounted=step.mounted))
        self._model = self._models[step.mounted]
        self._targets = Targets(self._model)

    def joints(self, step: JointStep) -> str:
        """Move joints; returns what is wrong."""
        named = step.joints
        if step.goal is not None and (self.q is None or step.goal.aim.frame != BASE):
            self.q = None
        elif step.known or named is None or self.q is not None:
            start = self._model.home if self.q is None else self.q
            try:
                self.q = self._targets.joints(step, start)
            except NoPlace as error:
                self.q = None
                return str(error)
        if step.goal is not None:
            return ""
        for i, value in enumerate(named or ()):
            low, high = self._model.limits.position[i]
            if value is not None and not low - LIMIT_TOLERANCE_RAD <= value <= high + LIMIT_TOLERANCE_RAD:
                self.q = None
                return str(joint_violation(self._model, i, value))
        return ""

    def line(self, step: LineStep) -> str:
        """Move on a line; returns what is wrong."""
        if step.aim.frame != BASE:
            self.q = None
            return ""
        if self.q is None or step.wrist_may_flip:
            self.q = None
            return self._whole_pose(step)
        present = self._model.forward(self.q)
        try:
            target = self._targets.pose(step.position_m, step.orientation_abc, step.aim, present)
        except NoPlace as error:
            self.q = None
            return str(error)
        geometry = LineGeometry.between(present, target)
        count = 2 + min(MOST_SAMPLES, math.ceil(max(geometry.length_m / STEP_M, geometry.angle / STEP_RAD)))
        try:
            self.q = self._model.track(geometry.poses(np.linspace(0.0, 1.0, count)), start=self.q)[-1]
        except TrackError as error:
            self.q = None
            x, y, z = 1000 * error.pose[:3, 3]
            return f"at X {x:.1f} Y {y:.1f} Z {z:.1f} mm {error.violation}"
        except KinematicsError as error:
            self.q = None
            return str(error)
        return ""

    def _whole_pose(self, step: LineStep) -> str:
        if not step.aim.joints and (None in step.position_m or step.orientation_abc is None):
            return self._named_place(step)
        try:
            pose = self._targets.pose(step.position_m, step.orientation_abc, step.aim, np.eye(4))
        except NoPlace as error:
            return str(error)
        violation = self._model.why_unreachable(pose)
        return "" if violation is None else str(violation)

    def _named_place(self, step: LineStep) -> str:
        named_m = math.hypot(*(value for value in step.position_m if value is not None))
        reach_m = self._model.reach_m
        if named_m <= reach_m:
            return ""
        return (
            f"at least {1000 * named_m:.0f} mm from the base, no part of the robot gets beyond {1000 * reach_m:.0f} mm"
        )
