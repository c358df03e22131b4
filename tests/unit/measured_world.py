"""An agent whose robot follows a belt or a sensor, and what is measured for it."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cell.config.settings import ConveyorSettings, CorrectionSettings, PoseSettings, SensorFrame
from cell.messages import CellTime, Command, ConveyorCount, Correction, Enable, Mode, ProgramState, Reply, Run
from robot_agent.kinematics import Model
from tests.unit.agent_world import CYCLE_S, STEP_S, AgentWorld

HERE = PoseSettings((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
COUNTS_PER_M = 10_000.0
SEAM = CorrectionSettings("seam", SensorFrame.BASE, None, 0.05, 0.0, 0.05, 0.2, 0.2, 2.0)
BELT = CorrectionSettings("belt", None, ConveyorSettings("line", HERE, COUNTS_PER_M, 0.5), 0.3, 0.0, 0.1, 0.2, 0.2, 2.0)
WIDE = CorrectionSettings("wide", SensorFrame.BASE, None, 2.0, 0.0, 0.05, 0.2, 0.5, 2.0)
PICK = replace(BELT, name="pick", conveyor=ConveyorSettings("parts", HERE, COUNTS_PER_M, 0.5, parts=True))
ALL = {each.name: each for each in (SEAM, BELT, PICK, WIDE)}
START = "MJ J1=10 J2=-10 J3=30 J4=0 J5=60 J6=0\n"


class Measured(AgentWorld):
    """With a sensor and a belt that are measured at every step, as long as they are."""

    def __init__(self, program: str, arm: Model | None = None) -> None:
        super().__init__(program, arm=arm, corrections=ALL)
        self.offset_m = (0.0, 0.0, 0.0)
        self.belt_m_s = 0.0
        self.measured_now = True
        self.part_at: float | None = None
        """When the newest part passed."""

    def step(self) -> None:
        if self.measured_now:
            at = CellTime("m", self.now)
            for name in ("seam", "wide"):
                self.agent.receive(Correction("left", name, at, self.offset_m), self.now)
            counts = round(self.belt_m_s * self.now * COUNTS_PER_M) % 2**32
            part = None if self.part_at is None else round(self.belt_m_s * self.part_at * COUNTS_PER_M) % 2**32
            for name in ("line", "parts"):
                self.agent.receive(ConveyorCount(name, at, counts, part), self.now)
        super().step()

    def until(self, done: Callable[[], bool], seconds: float = 40.0) -> None:
        for _ in range(round(seconds / STEP_S)):
            if done():
                return
            self.step()
        raise AssertionError(f"not reached in {seconds} s; state {self.states[-1:]}, {self.events}")

    def start(self) -> None:
        self.until(lambda: self.states != [] and self.state.mode is Mode.DISABLED)
        self.call(Enable())
        self.until(lambda: self.state.mode is Mode.READY)
        self.call(Run())
        self.until(lambda: self.state.mode is Mode.RUNNING)

    def until_line(self, line: int) -> None:
        self.until(lambda: self.state.program.line == line)

    def until_rest(self) -> None:
        self.until(lambda: not np.any(np.diff(self.played[-20:], axis=0)), seconds=3.0)

    def answer(self, command: Command) -> Reply:
        """What an operator is answered."""
        id = self.call(command)
        self.step()
        return self.replies[id]

    @property
    def done(self) -> bool:
        return self.state.program.state is ProgramState.DONE

    def places(self) -> np.ndarray:
        """The TCP `(m, 3)` at every tick."""
        return np.asarray(self.planner.model.forward(np.array(self.played))[:, :3, 3])


def shares(world: Measured) -> np.ndarray:
    """The largest shares of speed, ramp acceleration and ramp jerk."""
    limits = world.planner.limits
    allowed = (limits.velocity, limits.ramp_acceleration_bounds[1], limits.ramp_jerk)
    steps = (np.abs(np.diff(world.played, order, axis=0)) / CYCLE_S**order for order in (1, 2, 3))
    return np.array([(step / limit).max() for step, limit in zip(steps, allowed, strict=True)])
