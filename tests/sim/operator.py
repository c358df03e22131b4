"""A patient operator: enables, runs, continues, acknowledges and adopts, by calls over the same bad network."""

from cell.messages import (
    AdoptZone,
    Continue,
    Enable,
    Halt,
    Mode,
    ProgramState,
    ResetEstop,
    ResetRobot,
    Return,
    RobotState,
    Run,
    SetManual,
    SetOverride,
    Step,
    ZoneState,
)
from tests.sim.world import World

_LOOK_EVERY_S = 0.3


class PatientOperator:
    """Looks at the cell now and then and does what is needed until every program has ended once."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.done: set[str] = set()
        self.working = True
        world.clock.after(_LOOK_EVERY_S, self._look)

    @property
    def all_done(self) -> bool:
        return self.done == set(self._world.cell.robots)

    def _look(self) -> None:
        if self.working:
            for state in list(self._world.seen.robots.values()):
                self._serve(state)
            self._serve_zones()
        self._world.clock.after(_LOOK_EVERY_S, self._look)

    def _serve(self, state: RobotState) -> None:
        to = f"robot/{state.robot}"
        if state.program.state is ProgramState.DONE:
            self.done.add(state.robot)
        match state.mode:
            case Mode.DISABLED:
                self._world.operate(to, Enable())
            case Mode.READY if state.robot not in self.done:
                self._world.operate(to, Run())
            case Mode.HALTED:
                self._world.operate(to, Continue())
            case Mode.OFF_PATH:
                self._world.operate(to, Return())
            case Mode.FAULT:
                self._world.operate(to, ResetRobot())
            case Mode.ESTOP:
                manager = self._world.seen.manager
                ids = tuple(estop.id for estop in manager.estops) if manager is not None else ()
                self._world.operate("manager", ResetEstop("operator", ids))
            case _:
                pass

    def _serve_zones(self) -> None:
        manager = self._world.seen.manager
        for name, zone in manager.zones.items() if manager is not None else ():
            if zone.state is ZoneState.ORPHANED and zone.holder is not None:
                self._world.operate("manager", AdoptZone(name, zone.holder, "operator"))


class RestlessOperator(PatientOperator):
    """Also changes override, manual speed and step mode at random, halts, and lets everything run now and then."""

    def _serve(self, state: RobotState) -> None:
        super()._serve(state)
        rng, to = self._world.rng, f"robot/{state.robot}"
        if rng.random() < 0.5:
            forwards = [SetOverride(100.0)] if state.pace.override <= 0.0 else []
            percent = rng.choice([100.0, 100.0, 100.0, 60.0, 20.0, 0.0, -40.0, -100.0])
            calls = [*forwards, SetOverride(percent), SetManual(rng.random() < 0.2), Step(), Halt(), Continue()]
            self._world.operate(to, rng.choice(calls))
