"""A long chain of moves through a shared zone on a bad network: extended while it runs, held, halted, never unsafe."""

from collections.abc import Callable
from pathlib import Path

import pytest

from cell.messages import Halt, Mode, ProgramState, RobotState
from robot_agent.agent.planning import lookahead
from robot_agent.agent.planning.plans import Extended
from tests.sim.invariants import Invariants
from tests.sim.operator import PatientOperator
from tests.sim.scenario import BAD
from tests.sim.world import World, load_bundle
from tests.unit.config_world import Copy

ENDLESS = """MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0 F=80
ML X=980 Y=0 Z=1350 A=0 B=90 C=0 F=900
LABEL again
ML X=1200 F=900
ML X=1400 F=900
ML X=1650 F=900 R=60
ML Z=1500 F=900 R=60
ML X=1400 F=900
ML X=1200 F=900
ML X=980 F=900 R=60
ML Z=1350 F=900 R=60
GOTO again
"""
ONCE = """MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0 F=80
ML X=1600 Y=150 Z=1350 A=0 B=90 C=0 F=900
ML X=980 Y=0 Z=1450 F=900
END
"""


class Cell:
    """The two arms; the left one goes round and round through the zone, the right one goes there once."""

    def __init__(self, folder: Path) -> None:
        copy = Copy(folder).slow_buses()
        (copy.folder / "two_arms" / "programs" / "left.prog").write_text(ENDLESS)
        (copy.folder / "two_arms" / "programs" / "right.prog").write_text(ONCE)
        self.world = World(load_bundle(copy.folder / "two_arms" / "cell.yaml"), 7, BAD)
        self.invariants = Invariants(self.world)
        PatientOperator(self.world)
        self.until(lambda: "left" in self.world.seen.robots)

    @property
    def left(self) -> RobotState:
        return self.world.seen.robots["left"]

    @property
    def extensions(self) -> list[Extended]:
        return [each for each in self.world.seen.planned["left"] if isinstance(each, Extended)]

    @property
    def on_newest(self) -> bool:
        """Whether the left arm is on its newest extension."""
        return self.left.governor.duration_s == self.extensions[-1].motion.duration_s

    def halt(self) -> None:
        """An order may be lost; the operator who continues a halted robot is the patient one."""
        for _ in range(10):
            self.world.operate("robot/left", Halt())
            if self.world.clock.run_until(self.world.clock.now + 0.5, lambda: self.left.governor.rate < 0.5):
                return
        raise AssertionError("left does not halt")

    def until(self, done: Callable[[], bool]) -> None:
        assert self.world.clock.run_until(self.world.clock.now + 30.0, done)


def test_endless_chain_waits_for_a_zone_halts_and_goes_on_and_else_never_stops(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lookahead, "_KEPT_S", 0.5)
    cell = Cell(tmp_path)
    cell.until(lambda: "handover" in cell.left.waited_s)
    cell.until(lambda: cell.extensions != [] and cell.on_newest)
    cell.halt()
    cell.until(lambda: cell.left.mode is Mode.RUNNING and cell.left.governor.rate == 1.0)
    speeds = []
    cell.world.on_feedback.append(lambda _: speeds.append(cell.left.tcp_speed_m_s))
    cell.until(lambda: len(cell.extensions) > 1 and cell.on_newest)
    cell.world.clock.run_until(cell.world.clock.now + 0.3)
    assert cell.extensions[-1].cut_s > 0.0
    assert min(speeds) > 0.2
    assert min(cell.invariants.time_inside_s.values()) > 0.5
    assert cell.world.seen.robots["right"].program.state is ProgramState.DONE
