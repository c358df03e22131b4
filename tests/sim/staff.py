"""The people of a cell: a patient one who brings everything back, and what others need of the truth to be honest."""

from cell.messages import (
    AcceptPosition,
    AdoptZone,
    ClearZone,
    Continue,
    DriveFeedback,
    Enable,
    Mode,
    ProgramState,
    Reply,
    ResetEstop,
    ResetRobot,
    Return,
    RobotState,
    Run,
    SetOverride,
    ZoneState,
)
from tests.sim.jog_aside import JogAside
from tests.sim.judge.facts import OFF_S, Facts
from tests.sim.stand_off import StandOffs
from tests.sim.world import World

_LOOK_EVERY_S = 0.3
PATIENT = "patient"


class Staff:
    """Brings every program to its end, by the commands that the cell's own messages recommend."""

    def __init__(self, world: World, facts: Facts) -> None:
        self._world = world
        self._facts = facts
        self.done: set[str] = set()
        """Robots whose programs have ended."""
        self.working = True
        self.endless = True
        """Programs that have ended are started again."""
        self.orders = 0
        self._left_alone: dict[str, float] = {}
        self._stopped: dict[frozenset[str], float] = {}
        """Since when these emergency stops are seen in force."""
        self._jog_aside = JogAside(world, facts, PATIENT, self._order)
        self._stand_offs = StandOffs(facts, self._order)
        world.operator(PATIENT)
        world.on_published.append(self._hear)
        world.clock.after(_LOOK_EVERY_S, self._look)

    @property
    def all_done(self) -> bool:
        return self.done == set(self._world.cell.robots)

    # The patient one

    def _look(self) -> None:
        eyes = self._world.operator(PATIENT)
        if self.working and not self.endless:  # an agent that was refused for long has ended, and says so
            for name in self._world.processes:
                self._world.start(name)
        if self.working:
            states = list(eyes.robots.values())
            if self._world.cell.separation is not None:
                self._jog_aside.look(states, self.done)
                self._stand_offs.look(state for state in states if not self._jog_aside.busy_with(state.robot))
            for state in states:
                self._serve(state)
            for feedback in list(self._facts.feedback.values()):
                self._refer(feedback)
            manager = eyes.manager
            if manager is not None and manager.estops:
                self._reset_when_off(frozenset(estop.id for estop in manager.estops))
            for zone, status in manager.zones.items() if manager is not None else ():
                if status.state is ZoneState.ORPHANED:
                    self.adopt(PATIENT, zone)
                    self.clear(PATIENT, zone)
        self._world.clock.after(_LOOK_EVERY_S, self._look)

    def _hear(self, _: str, message: object) -> None:
        """Do what a refused `adopt` recommends: clear the zone of those who are silent and seen outside, then again."""
        if isinstance(message, Reply) and not message.ok and "then once more `cell zone adopt" in message.text:
            zone = message.text.partition("`cell zone clear ")[2].partition("`")[0]
            self._world.clock.after(_LOOK_EVERY_S, self._clear_of_the_silent, zone)

    def _clear_of_the_silent(self, zone: str) -> None:
        """One robot is inside, which is heard; the others are seen outside, and nobody moves."""
        facts = self._facts
        inside = [robot for robot in facts.robots if zone in facts.inside_now(robot)]
        heard = len(inside) == 1 and facts.presence_fresh(inside[0])
        if self.working and heard and not any(map(facts.moving, facts.robots)):
            self._world.operate("manager", ClearZone(zone, PATIENT), PATIENT)

    def _refer(self, feedback: DriveFeedback) -> None:
        """Say that a robot whose drives have lost where they are is where they show it, having looked."""
        robot, facts = feedback.robot, self._facts
        if not feedback.referenced and not feedback.enabled and not facts.moving(robot):
            self._world.operate(facts.gateway_of(robot), AcceptPosition(robot, ()), PATIENT)

    def _reset_when_off(self, stops: frozenset[str]) -> None:
        """When all drives are off; or when they should have been for long."""
        facts = self._facts
        since = self._stopped.setdefault(stops, facts.now)
        off = not any(feedback.enabled for feedback in facts.feedback.values())
        if off or facts.now - since > facts.cell.times.estop_delay_s + OFF_S + _LOOK_EVERY_S:
            self.reset_estop(PATIENT)

    def _order(self, robot: str, command: object) -> None:
        self.orders += 1
        self._world.operate(f"robot/{robot}", command, PATIENT)  # type: ignore[arg-type]

    def leave_alone(self, robot: str, seconds: float) -> None:
        """Somebody else works with this robot."""
        self._left_alone[robot] = max(self._left_alone.get(robot, 0.0), self._facts.now + seconds)

    def _serve(self, state: RobotState) -> None:
        robot = state.robot
        parted = self._stand_offs.busy_with(robot) or self._jog_aside.busy_with(robot)
        if self._facts.now < self._left_alone.get(robot, 0.0) or parted:
            return
        if state.program.state is ProgramState.DONE and state.mode is Mode.READY and not self.endless:
            self.done.add(robot)
        if state.pace.override != 1.0 and state.mode is not Mode.ESTOP:
            self._order(robot, SetOverride(100.0))
        match state.mode:
            case Mode.DISABLED if robot not in self.done:
                self._order(robot, Enable())
            case Mode.READY if robot not in self.done:
                self._order(robot, Run())
            case Mode.HALTED:
                self._order(robot, Continue())
            case Mode.OFF_PATH:
                self._order(robot, Return())
            case Mode.FAULT:
                self._order(robot, ResetRobot())
            case _:
                pass

    # What honest people do

    def reset_estop(self, by: str) -> None:
        """Clear the stop that this operator sees."""
        manager = self._world.operator(by).manager
        if manager is None or not manager.estops:
            return
        self._world.operate("manager", ResetEstop(by, tuple(estop.id for estop in manager.estops)), by)

    def clear(self, by: str, zone: str) -> None:
        """Say that nobody is inside, having looked: all stand, and nobody is; also of a zone that somebody holds."""
        facts, manager = self._facts, self._world.operator(by).manager
        if manager is None or manager.zones[zone].state is ZoneState.FREE:
            return
        if not any(zone in facts.inside_now(robot) or facts.moving(robot) for robot in facts.robots):
            self._world.operate("manager", ClearZone(zone, by), by)

    def adopt(self, by: str, zone: str) -> None:
        """Give an orphaned zone to the robot that really stands in it."""
        facts, manager = self._facts, self._world.operator(by).manager
        if manager is None or manager.zones[zone].state is not ZoneState.ORPHANED:
            return
        inside = [robot for robot in facts.robots if zone in facts.inside_now(robot)]
        if len(inside) == 1:
            self._world.operate("manager", AdoptZone(zone, inside[0], by), by)
