"""What the agent tells everyone: the robot's state and events."""

import numpy as np
from numpy.typing import NDArray

from cell.core import Publish
from cell.geometry.pose import compose
from cell.geometry.quaternion import from_matrix
from cell.messages import (
    CorrectionStatus,
    DriveFeedback,
    Event,
    GovernorStatus,
    Mode,
    MoveStatus,
    PaceStatus,
    Reserve,
    RobotState,
    Severity,
)
from robot_agent.agent.blocks.executive import Executive
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.program.program_run import ProgramRun
from robot_agent.agent.step.present_move import PresentMove
from robot_agent.kinematics import Model, OpenMechanism

Joints = tuple[float, ...]
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

_RESERVE_EVERY = 10
"""States: what is left of a motion changes slowly, and takes longer to work out than all else in a state."""


class Reporter:
    """Numbers and builds the messages for people and views."""

    def __init__(self, robot: str, boot: str) -> None:
        self._robot = robot
        self._boot = boot
        self._sequence = 0
        self._events: list[Event] = []
        self._event_sequence = 0
        self._reserve: Reserve | None = None
        self._present_move = PresentMove()

    def event(self, severity: Severity, code: str, text: str, remedy: str = "") -> None:
        """Note something that happened; it is sent with the next step."""
        self._event_sequence += 1
        source = f"robot/{self._robot}"
        self._events.append(Event(source, self._event_sequence, severity, code, text, remedy, boot=self._boot))

    def take_events(self) -> list[Publish]:
        events, self._events = self._events, []
        return [Publish(event) for event in events]

    def state(
        self,
        mode: Mode,
        run: ProgramRun,
        feedback: DriveFeedback | None,
        executive: Executive | None,
        planner: Planner,
        pace: PaceStatus,
        zones: tuple[str, ...],
        waiting_for: str,
        alarms: tuple[str, ...],
    ) -> RobotState:
        """The robot's state at the newest feedback; without one nothing is said about where it is."""
        self._sequence += 1
        joints, position, quaternion, move, reserve = None, None, None, None, None
        speed, governor, correction = None, None, None
        if feedback is not None:
            speed, governor, correction = _commanded(run, feedback, executive, planner)
            joints, position, quaternion = _measured(feedback, planner)
            move = self._move(run, feedback, executive)
            reserve = self._left(feedback, planner) if position is not None else None
            self._reserve = reserve
        return RobotState(
            robot=self._robot,
            boot=self._boot,
            sequence=self._sequence,
            mode=mode,
            program=run.status,
            joints=joints,
            tcp_position_m=position,
            tcp_quaternion_xyzw=quaternion,
            tcp_speed_m_s=speed,
            governor=governor,
            pace=pace,
            zones=zones,
            waiting_for=waiting_for,
            waited_s=dict(run.waited_s),
            alarms=alarms,
            correction=correction,
            reserve=reserve,
            move=move,
        )

    def _left(self, feedback: DriveFeedback, planner: Planner) -> Reserve:
        """What is left of motion, or was some states ago."""
        if self._reserve is None or self._sequence % _RESERVE_EVERY == 0:
            return _reserve(planner.model, feedback.position)
        return self._reserve

    def _move(self, run: ProgramRun, feedback: DriveFeedback, executive: Executive | None) -> MoveStatus | None:
        if executive is None or not run.running:
            return None
        block, _ = executive.timeline.at(feedback.tick)
        if block.path.motion.duration_s == 0.0:
            return None
        tau = block.path_state(feedback.tick).tau
        return self._present_move.at(executive.supply.planner, block.path.motion, tau)


def _commanded(
    run: ProgramRun, feedback: DriveFeedback, executive: Executive | None, planner: Planner
) -> tuple[float, GovernorStatus | None, CorrectionStatus | None]:
    """How fast the tool is [m/s], how its motion is gone through, and what is beside that."""
    if executive is None:
        return 0.0, None, None
    block, index = executive.timeline.at(feedback.tick)
    segment, path = block.segment, block.path_segment.state(index)
    governor = GovernorStatus(path.rate, path.tau, block.path.motion.duration_s, segment.ruled_by)
    correction = None
    if block.followed is not None and run.correction:
        x, y, z, a, b, c = block.followed.given.offset(index).tolist()
        correction = CorrectionStatus(run.correction, (x, y, z), (a, b, c))
    qd = segment.qd[index]
    speed = float(planner.model.tool_speed(segment.q[index], qd)) if qd.any() else 0.0
    return speed, governor, correction


def _measured(feedback: DriveFeedback, planner: Planner) -> tuple[Joints | None, Vector | None, Quaternion | None]:
    """Joints, and where the TCP is [m] and how it is turned; None for joints that are not referenced, and for a TCP
    that cannot be so."""
    if not feedback.referenced:
        return None, None, None
    joints = tuple(feedback.position.tolist())
    try:
        pose = compose(planner.pose_world_base, planner.model.forward(feedback.position))
    except OpenMechanism:
        return joints, None, None
    x, y, z = pose[:3, 3].tolist()
    qx, qy, qz, qw = from_matrix(pose[:3, :3]).tolist()
    return joints, (x, y, z), (qx, qy, qz, qw)


def _reserve(model: Model, q: NDArray[np.float64]) -> Reserve:
    """How much motion is left at joints `(n,)`."""
    singularity, left = model.singularity(q), model.from_limits(q)
    nearest = int((left / np.ptp(model.limits.position, axis=-1)).argmin())
    return Reserve(
        singular=str(singularity.name),
        from_singular=min(float(singularity.nearest), 1.0),
        manipulability=float(model.manipulability(q)),
        joint=model.joint_names[nearest],
        from_limit=float(left[nearest]),
    )
