"""What really is the case in a simulated cell, and what each process was told: the evidence of all invariants.

Nothing here uses the product's own rules of freshness and order: when each message was sent is known.
"""

import functools
import itertools
from collections import defaultdict, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf

import numpy as np
from numpy.typing import NDArray

from cell.core import Request
from cell.geometry import Box, body_touches, transform_points
from cell.manager.core import ManagerCore
from cell.messages import (
    Call,
    DriveFeedback,
    EnableDrives,
    Estop,
    GatewayState,
    Heard,
    ManagerState,
    Mode,
    Presence,
    ResetDrives,
    RobotState,
    Sections,
    SetpointBlock,
    TokenGone,
)
from drive_gateway.gateway.core import GatewayCore
from tests.sim.volume import Volume
from tests.sim.world import World

Floats = NDArray[np.float64]

STRANGER = "stranger"
"""Sends what nobody of the cell has sent."""
SAMPLE_S = 0.02
"""How often it is looked where the robots really are."""
BATCH = 32
"""Moments that are judged together."""
FREEZE_S = 0.25
OFF_S = 2.0
"""For quick stop, brakes and switching off, after the time in which agents may brake under an emergency stop."""
_STILL = 1e-8
"""[rad or m] from one sample to the next."""
_CREEPS, _CREEPS_SAMPLES = 5e-5, 6
"""[rad or m] from one sample to the next, and over how many: more than 2.5 mrad/s or mm/s for 0.1 s."""
_A_FEW = 5
"""Messages of state that are on their way at a time."""
_TELLS_S = 0.15
"""From an agent that knows where its robot is to a manager's state that says so."""
MOVING = 0.02
"""[rad/s or m/s] An axis that is faster than this moves; slower, its drive may settle."""


BY_FEEDBACK = EnableDrives, ResetDrives
"""What an agent orders of its gateway answers feedback of its drives, not a state."""


@dataclass(slots=True, eq=False)
class Shown:
    """A presence, and when it left."""

    message: Presence
    at: float
    still_since: float
    """Since then all presences say that the robot stands; infinite where this one does not."""
    _poses: Floats | None = None
    _touched: dict[str, bool] = field(default_factory=dict)

    @property
    def poses(self) -> Floats:
        """`(m, c, 2, 3)` [m]."""
        if self._poses is None:
            self._poses = self.message.body.poses.astype(float)
        return self._poses

    def touches(self, zone: str, volume: Volume) -> bool:
        """By the rule that manager and agents share."""
        if zone not in self._touched:
            self._touched[zone] = body_touches(self.message.body, volume.solid, volume.of)
        return self._touched[zone]

    def misses(self, points: Floats, tcp: Floats) -> Floats:
        """By how much [m] bodies `(k, c, 2, 3)` and TCPs `(k, 3)` are outside, `(k,)`; 0 or less: they lie within.

        A capsule lies within a pose's capsule that is grown by as much as its ends are away.
        """
        points = np.concatenate([points, np.stack([tcp, tcp], axis=1)[:, None]], axis=1)
        body = self.message.body
        if not body.known or len(body.poses) == 0:
            away = np.linalg.norm(points - np.array(body.base), axis=-1).max(axis=(1, 2))
            return np.asarray(away - body.reach_m)
        tcps = np.repeat(body.tcp_m.astype(float)[:, None, None], 2, axis=2)
        away = np.linalg.norm(points[:, None] - np.concatenate([self.poses, tcps], axis=1), axis=-1).max(axis=-1)
        return np.asarray((away - body.growth_m[:, None]).min(axis=1).max(axis=-1))


@dataclass(slots=True, eq=False)
class Sample:
    """Where a robot really was, and what had been said by then."""

    at: float
    robot: str
    axes: Floats
    """`(n,)` [rad or m] by the simulated drives themselves."""
    moving: bool
    """It was elsewhere one sample before."""
    shown: Shown | None
    """The newest presence of the robot."""
    manager: ManagerState | None
    """The newest state of the living manager; None while none lives or it has said nothing yet."""
    mode: Mode
    mode_since: float
    """By the newest state of the robot."""
    spoken_for: bool
    """The agent that published it runs, and is not frozen."""
    points: Floats = field(default_factory=lambda: np.zeros((0, 2, 3)))
    """`(c, 2, 3)` [m] capsules in world."""
    tcp: Floats = field(default_factory=lambda: np.zeros(3))
    """`(3,)` [m] in world."""
    inside: frozenset[str] = frozenset()
    """The zones that the real body, or its TCP, touches."""


@dataclass(slots=True)
class Told:
    """What the present boot of a process was told."""

    boot: str
    since: float
    thawed_at: float = -inf
    """It forgot then what it had sent."""
    frozen_at: float = inf
    manager: ManagerState | None = None
    """The newest, of an agent."""
    presences: dict[str, Presence] = field(default_factory=dict)
    """The newest of each robot, of a manager."""
    gone: set[str] = field(default_factory=set)
    """Robots whose token went since, of a manager."""
    estops: dict[str, float] = field(default_factory=dict)
    """Stops that are in force for it, since when."""
    cleared: set[str] = field(default_factory=set)
    """Stops whose end it was told, which a manager had told by then."""
    calls: list[tuple[float, Call]] = field(default_factory=list)
    feedback: DriveFeedback | None = None
    """The newest, of an agent."""
    feedback_at: float = -inf
    """When a newer one came last that says that this agent owns its robot; one that others overtook tells nothing."""


@dataclass(frozen=True, slots=True, eq=False)
class SentBlock:
    """A set-point block, and when it left."""

    message: SetpointBlock
    at: float


def _feedback_of(robot: str, boot: str) -> str:
    """A gateway numbers the feedback of each robot apart from its states."""
    return f"feedback of {robot}, {boot}"


def rest_row(block: SetpointBlock) -> int:
    """The first row of a block from which on it stands; 0 when it moves nothing."""
    moved = np.flatnonzero((np.abs(np.diff(block.position, axis=0)) > _STILL).any(axis=1))
    return int(moved[-1]) + 1 if moved.size else 0


class Facts:
    """Follows a world."""

    def __init__(self, world: World) -> None:
        self.world = world
        self.cell = world.cell
        self.start = world.clock.now
        self.robots = tuple(world.cell.robots)
        self.boxes = {zone.name: Volume.at(zone) for zone in world.cell.zones.values()}
        self.order: dict[str, int] = {}
        """Boots in the order of their starts."""
        self.sent: dict[tuple[str, int], float] = {}
        """When a state, a presence or a manager's state left, by boot and sequence."""
        self.told: dict[str, Told] = {}
        self._freezes: dict[str, list[tuple[float, float]]] = defaultdict(list)
        """By process: since when and until when it was frozen, one after another."""
        self.shown: dict[str, Shown] = {}
        self.manager: ManagerState | None = None
        self.states: dict[str, RobotState] = {}
        self.modes: dict[str, tuple[Mode, float]] = {}
        """The mode that a robot says to be in, and since when."""
        self.feedback: dict[str, DriveFeedback] = {}
        self.gateways: dict[str, GatewayState] = {}
        self.blocks: dict[str, dict[tuple[int, int], SentBlock]] = {robot: {} for robot in self.robots}
        """By robot: all blocks, by owner and sequence."""
        self.newest_block: dict[str, SentBlock] = {}
        self.ended: set[str] = set()
        """Emergency stops whose end a manager has told."""
        self._owners: dict[str, list[int]] = defaultdict(list)
        """Of each robot, as its gateway has named them, one after another; 0 is one too."""
        self.troubled_until = 0.0
        """The plan's newest fault has worn off."""
        self.hindered_until: dict[str, float] = {}
        """Robots with a drive that fails do not go where they are told."""
        self._told_until: dict[str, float] = {}
        """By robot, until when not everybody has heard where it is after its drives had failed."""
        self._aware_at: dict[str, float] = {}
        """When the agent of a robot was last told where the robot is."""
        self._unaware: dict[str, tuple[float, float]] = {}
        """From when to when it was told nothing of that the last time that this was for too long."""
        self.slips_until: dict[str, float] = {}
        """Until when the brake of one of a robot's drives slips, or somebody pushes the robot."""
        self.silenced: dict[str, tuple[float, float]] = {}
        """Since when and until when the node of one of a robot's drives is off the bus."""
        self.journal_spoilt = False
        """The manager's journal was lost, was old when it was read, or could not be written for a while."""
        self.on_samples: Callable[[Sample], None] = lambda _: None
        self.samples = 0
        self._seen: Shown | None = None
        self._kept: list[Sample] = []
        self._axes: dict[str, Floats] = {}
        self._moving: dict[str, bool] = {}
        self._lately: dict[str, deque[Floats]] = {robot: deque(maxlen=_CREEPS_SAMPLES) for robot in self.robots}
        for name, process in world.processes.items():
            self._started(name, process.boot)
        world.clock.after(SAMPLE_S, self._sample)

    @property
    def now(self) -> float:
        return self.world.clock.now

    def calm(self, for_s: float) -> bool:
        """No fault was at work for so long."""
        return self.now - self.troubled_until >= for_s

    def hindered(self, robot: str, at: float | None = None) -> bool:
        """Whether one of the robot's drives fails, did lately, or has and the robot's agent cannot know it yet."""
        until = self.hindered_until.get(robot, 0.0)
        unaware = self._aware_at.get(robot, 0.0) < until
        return unaware or (self.now if at is None else at) < max(until, self._told_until.get(robot, 0.0))

    def silence(self, robot: str, seconds: float, *, heard: bool = True) -> None:
        """The node of one of its drives is off the bus from now on; it has been before, unless it was `heard`."""
        since, until = self.silenced.get(robot, (self.now, self.now))
        self.silenced[robot] = self.now if heard else since, max(until, self.now + seconds)

    def _aware(self, robot: str) -> None:
        """Its agent was told where it is: what a drive did before that nobody could know, and soon everybody does."""
        until = self.hindered_until.get(robot, 0.0)
        before = self._aware_at.get(robot, 0.0)
        if before < until <= self.now:
            self._told_until[robot] = self.now + _TELLS_S
        if self.now - before > self.cell.times.fresh_s:
            self._unaware[robot] = before, self.now
        self._aware_at[robot] = self.now

    def unaware(self, robot: str, at: float) -> bool:
        """Whether the robot's agent had been told nothing of where the robot is for too long."""
        old = at - self.cell.times.fresh_s
        since, until = self._unaware.get(robot, (at, at))
        return self._aware_at.get(robot, 0.0) < old or since < old < at < until

    def alive(self, name: str) -> bool:
        process = self.world.processes[name]
        return process.alive and not process.frozen

    def frozen_s(self, name: str, since: float) -> float:
        """How long [s] a process was frozen since then, freezes that are over alone."""
        return sum(max(0.0, end - max(begin, since)) for begin, end in self._freezes[name])

    def gateway_of(self, robot: str) -> str:
        return f"gateway/{self.cell.robots[robot].gateway}"

    # Freshness, by when things were really sent

    def age_of(self, heard: Heard | None, name: str) -> float:
        """How long ago [s] a process sent what an answer to it repeats; infinite when it was another boot, or a freeze
        of its own has made it forget."""
        told = self.told[name]
        if heard is None or heard.boot != told.boot:
            return inf
        at = self.sent.get((heard.boot, heard.sequence), -inf)
        return inf if at < told.thawed_at else self.now - at

    def manager_age(self, robot: str) -> float:
        """Of the newest manager state that the robot's agent was told [s]."""
        name = f"robot/{robot}"
        manager = self.told[name].manager
        return inf if manager is None else self.age_of(manager.heard.get(robot), name)

    def manager_fresh(self, robot: str) -> bool:
        return self.manager_age(robot) < self.cell.times.fresh_s + 1e-3

    def presence_age(self, robot: str) -> float:
        """Of the newest presence that the manager was told [s]."""
        told = self.told["manager"]
        presence = told.presences.get(robot)
        if presence is None or robot in told.gone:
            return inf
        return self.age_of(presence.heard, "manager")

    def presence_fresh(self, robot: str) -> bool:
        return self.presence_age(robot) < self.cell.times.fresh_s + 1e-3

    def presence_surely_fresh(self, robot: str) -> bool:
        """And not within 1 ms of the limit, where a manager may see it either way."""
        return self.presence_age(robot) < self.cell.times.fresh_s - 1e-3

    def call_age(self, call: Call, name: str) -> float:
        """How old [s] the state of the addressee is that a call answers."""
        heard, command = call.heard, call.command
        if heard is not None and name.startswith("robot/"):
            heard = Heard("state of " + heard.boot, heard.sequence)
        elif heard is not None and isinstance(command, BY_FEEDBACK):
            heard = Heard(_feedback_of(command.robot, heard.boot), heard.sequence)
        at = -inf if heard is None else self.sent.get((heard.boot, heard.sequence), -inf)
        return self.now - at

    # What is said and heard

    def published(self, name: str, message: object) -> None:
        """What a process of the cell, or an operator, has said."""
        match message:
            case Estop(active=False) if name == "manager":
                self.ended.add(message.id)
            case Presence():
                self.sent[message.boot, message.sequence] = self.now
                self.shown[message.robot] = self.seen(message)
            case ManagerState():
                self.sent[message.boot, message.sequence] = self.now
                self.manager = message
            case RobotState():
                self.sent["state of " + message.boot, message.sequence] = self.now
                self.states[message.robot] = message
                if self.modes.get(message.robot, (None, 0.0))[0] is not message.mode:
                    self.modes[message.robot] = message.mode, self.now
            case GatewayState():
                self.sent[message.boot, message.sequence] = self.now
                self.gateways[message.gateway] = message
            case DriveFeedback():
                self.sent[_feedback_of(message.robot, message.boot), message.sequence] = self.now
                self.feedback[message.robot] = message
                if message.owner not in self._owners[message.robot]:
                    self._owners[message.robot].append(message.owner)
            case SetpointBlock():
                sent = SentBlock(message, self.now)
                self.blocks[message.robot][message.owner, message.sequence] = sent
                self.newest_block[message.robot] = sent

    def _ended(self, block: SetpointBlock) -> list[int]:
        """The owners of the block's robot whose claims had ended when that of the block's owner began."""
        owners = self._owners[block.robot]
        return owners[: owners.index(block.owner)] if block.owner in owners else []

    def seen(self, presence: Presence) -> Shown:
        """A presence of this moment, with what is known of it."""
        if self._seen is None or self._seen.message is not presence:
            before = self.shown.get(presence.robot)
            since = inf if before is None else before.still_since
            still_since = inf if presence.stop_time_s > 0.0 else min(since, self.now)
            self._seen = Shown(presence, self.now, still_since)
        return self._seen

    def delivered(self, name: str, message: object) -> None:
        told = self.told[name]
        match message:
            case ManagerState():
                if self._newer(message.boot, message.sequence, told.manager):
                    told.manager = message
                for estop in message.estops:
                    self._estop(told, estop)
            case Presence():
                known = told.presences.get(message.robot)
                if known is None or (message.owner, message.sequence) > (known.owner, known.sequence):
                    told.presences[message.robot] = message
                    told.gone.discard(message.robot)
            case TokenGone():
                known = told.presences.get(message.name)
                if known is not None and known.boot == message.boot:
                    told.gone.add(message.name)
            case Estop():
                self._estop(told, message)
            case Request(_, Call() as call):
                told.calls.append((self.now, call))
            case DriveFeedback():
                newest = self.feedback[message.robot]
                prompt = message.boot == newest.boot and message.sequence > newest.sequence - _A_FEW
                claimed = message.owner != 0  # by no other one an agent goes
                if prompt and claimed and message.referenced and name == f"robot/{message.robot}":
                    self._aware(message.robot)
                if not self._newer(message.boot, message.sequence, told.feedback):
                    return
                told.feedback = message
                block = self.newest_block.get(message.robot)
                if block is None or block.at < told.since or message.owner not in self._ended(block.message):
                    told.feedback_at = self.now
            case _:
                pass

    def _newer(self, boot: str, sequence: int, than: ManagerState | DriveFeedback | None) -> bool:
        if than is None:
            return True
        return (self.rank(boot), sequence) > (self.rank(than.boot), than.sequence)

    def rank(self, boot: str) -> int:
        """Boots in the order of their starts; one that is no process of the cell's, in that in which it was heard."""
        return self.order.setdefault(boot, len(self.order))

    def _estop(self, told: Told, estop: Estop) -> None:
        if not estop.active:
            if estop.id in self.ended:  # else somebody has made it up: nobody but the manager ends a stop
                told.cleared.add(estop.id)
                told.estops.pop(estop.id, None)
        elif estop.id not in told.cleared:
            told.estops.setdefault(estop.id, self.now)

    def lived(self, name: str, what: str) -> None:
        told = self.told.get(name)
        if what == "started":
            self._started(name, self.world.processes[name].boot)
        elif what == "frozen" and told is not None:
            told.frozen_at = min(told.frozen_at, self.now)
        elif what == "thawed" and told is not None:
            self._freezes[name].append((told.frozen_at, self.now))
            if self.now - told.frozen_at > FREEZE_S:
                told.thawed_at = self.now
            told.frozen_at = inf
        if name == "manager" and what in ("started", "killed"):
            self.manager = None

    def _started(self, name: str, boot: str) -> None:
        self.order[boot] = len(self.order)
        self.told[name] = Told(boot, self.now)

    # Where the robots really are

    def measured(self, robot: str) -> Floats:
        """The axes by the simulated drives themselves, not by what anyone reports of them."""
        gateway = self.gateway_of(robot)
        axes = self.world.bundle.gateways[gateway.partition("/")[2]].robots[robot].axes
        nodes = self.world.buses[gateway].nodes
        return np.array([nodes[a.node_id].drives[a.number - 1].position / a.counts_per_unit + a.offset for a in axes])

    def queued(self, robot: str) -> Floats | None:
        """The samples `(m, n)` of the axes that the robot's gateway has queued, up to rest; None: blocks are not
        played."""
        process = self.world.processes[self.gateway_of(robot)]
        if not process.alive:
            return None
        assert isinstance(process.core, GatewayCore)
        playout = process.core._robots[robot].group.playout
        return playout._position[playout._row(playout.tick) :] if playout.live else None

    def reserved(self, robot: str) -> Sections | Box | None:
        """What the manager that lives keeps for a robot, or the box to which an operator has confined it; None: it
        waits for somebody, or does not know where it is."""
        process = self.world.processes["manager"]
        if not process.alive:
            return None
        assert isinstance(process.core, ManagerCore)
        separation = process.core._separation
        assert separation is not None
        ledger = separation._ledger
        if ledger.deposed or ledger.awaited:
            return None
        if (box := ledger._robots[robot].box) is not None:
            return box
        if ledger._robots[robot].lost:
            return None
        return functools.reduce(Sections.joined, ledger.reserved(robot), Sections())

    def points(self, robot: str, axes: Floats) -> Floats:
        """Capsules `(m, c, 2, 3)` [m] in world, for axes `(m, n)`."""
        planner, model = self.world.planners[robot], self.world.models[robot]
        return np.asarray(transform_points(planner.pose_world_base, model.capsules(model.coupling.joints(axes))))

    def tcp(self, robot: str, axes: Floats) -> Floats:
        """TCPs `(m, 3)` [m] in world, for axes `(m, n)`."""
        planner, model = self.world.planners[robot], self.world.models[robot]
        return np.asarray((planner.pose_world_base @ model.forward(model.coupling.joints(axes)))[..., :3, 3])

    def touching(self, robot: str, axes: Floats) -> dict[str, NDArray[np.bool_]]:
        """By zone: whether the robot is inside with axes `(m, n)`, `(m,)`."""
        points, tcp, radii = self.points(robot, axes), self.tcp(robot, axes), self.world.models[robot].capsule_radii
        return {zone: volume.touched(points, radii, tcp) for zone, volume in self.boxes.items()}

    def inside_now(self, robot: str) -> frozenset[str]:
        """The zones that the real body, or its TCP, touches at this moment."""
        touching = self.touching(robot, self.measured(robot)[None])
        return frozenset(zone for zone, flags in touching.items() if flags[0])

    def _sample(self) -> None:
        self.take_sample()
        self.world.clock.after(SAMPLE_S, self._sample)

    def take_sample(self) -> None:
        """Note where all robots are now."""
        for robot in self.robots:
            axes = self.measured(robot)
            before = self._axes.get(robot)
            moving = before is not None and bool((np.abs(axes - before) > MOVING * SAMPLE_S).any())
            self._axes[robot] = axes
            self._lately[robot].append(axes)
            mode, since = self.modes.get(robot, (Mode.STARTING, self.start))
            self._moving[robot] = moving
            shown, agent = self.shown.get(robot), f"robot/{robot}"
            spoken_for = shown is not None and self.alive(agent) and shown.message.boot == self.told[agent].boot
            self._kept.append(Sample(self.now, robot, axes, moving, shown, self.manager, mode, since, spoken_for))
        if len(self._kept) >= BATCH * len(self.robots):
            self.flush()

    def moving(self, robot: str) -> bool:
        """Between the two newest samples."""
        return self._moving.get(robot, False)

    def creeping(self, robot: str) -> bool:
        """It moves, however slowly: for some samples it was elsewhere in each."""
        lately = list(self._lately[robot])
        steps = itertools.pairwise(lately)
        return len(lately) == _CREEPS_SAMPLES and all((np.abs(b - a) > _CREEPS).any() for a, b in steps)

    def flush(self) -> None:
        """Compute the bodies of the samples kept, and hand them on."""
        kept, self._kept = self._kept, []
        for robot in self.robots:
            mine = [sample for sample in kept if sample.robot == robot]
            if not mine:
                continue
            axes = np.array([sample.axes for sample in mine])
            points, tcp, touching = self.points(robot, axes), self.tcp(robot, axes), self.touching(robot, axes)
            for i, sample in enumerate(mine):
                sample.points, sample.tcp = points[i], tcp[i]
                sample.inside = frozenset(zone for zone, flags in touching.items() if flags[i])
        for sample in kept:
            self.samples += 1
            self.on_samples(sample)
