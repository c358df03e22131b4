"""Whole cells in which one certain thing happens that generated cells hardly ever come to; judged as these are.

python -m tests.sim.scenes --seeds 0:4
"""

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from cell.messages import Command, Enable, Halt, Mode, Run
from robot_agent.workspace import FOLLOWING_M
from tests.sim.apart_cell import QUIET, apart_cell
from tests.sim.cells import MODELS
from tests.sim.checker import search
from tests.sim.faults import Pushed
from tests.sim.item import Stage
from tests.sim.judge import Broken, Judge
from tests.sim.programs import APPROACHES
from tests.sim.staff import Staff
from tests.sim.world import World, load_bundle
from tests.unit.config_world import Copy


class Scene:
    """A cell on links that lose nothing, its judge, and one operator."""

    def __init__(self, cell: Path) -> None:
        self.world = World(load_bundle(cell), 0, QUIET)
        self.facts = Judge(self.world).facts
        self.staff = Staff(self.world, self.facts)
        self.staff.endless = False
        self.until("all robots are heard", lambda: len(self.world.seen.robots) == len(self.facts.robots))

    def until(self, what: str, done: Callable[[], bool], longest_s: float = 20.0) -> None:
        """Raises `Broken` when it does not come to that."""
        clock = self.world.clock
        if not clock.run_until(clock.now + longest_s, done):
            states = sorted(self.world.seen.robots.items())
            waits = "; ".join(f"{robot} is {state.mode.value} and waits: {state.waiting_for}" for robot, state in states)
            raise Broken(what, clock.now - self.facts.start, ", ".join(self.facts.robots), waits)

    def order(self, robot: str, command: Command, then: Mode) -> None:
        """A call, until it has brought the robot into a mode."""
        self.world.operate(f"robot/{robot}", command)
        self.until(f"{robot} is {then.value}", lambda: self.world.seen.robots[robot].mode is then)

    def line(self, robot: str) -> int:
        return self.world.seen.robots[robot].program.line

    def done(self, longest_s: float = 60.0) -> None:
        """Until all programs have come to their ends."""
        self.until("everyone is done in the end", lambda: self.staff.all_done, longest_s)


BESIDE = """MJ J1={turn:g} J2=-12 J3=65 J4=0 J5=37 J6=0 F=100
ML X=1720 Y={y:g} Z=1250 A=0 B=90 C=0 F=1000
"""


def pushed_too_near(folder: Path) -> None:
    """An arm is pushed by hand to less than the margin from another one: that one comes no nearer, and goes on when the
    first has gone back."""
    right, left = BESIDE.format(turn=0, y=0), BESIDE.format(turn=20, y=650) + "WAIT 1\nML Y=500 F=300\n"
    scene = Scene(apart_cell(folder, {"right": right, "left": left}))
    scene.until("left stands beside right", lambda: scene.line("left") == 3)
    scene.world.operate("robot/left", Halt())
    scene.staff.leave_alone("left", 5.0)
    Pushed(0.0, None, "anna", "right", -0.4).strike(Stage(scene.world, scene.facts, scene.staff, set()))
    scene.until("right is in left's way", lambda: scene.world.seen.robots["left"].waiting_for.startswith("left's link"))
    scene.world.clock.run_until(scene.world.clock.now + 2.0)
    scene.order("right", Enable(), Mode.READY)
    scene.order("right", Run(), Mode.RUNNING)
    scene.done()


SCENES = (pushed_too_near,)


def broken(number: int) -> tuple[str, float]:
    """What is wrong in this scene, and when."""
    with tempfile.TemporaryDirectory(prefix="scene-") as folder:
        try:
            SCENES[number](Path(folder))
        except Broken as error:
            return f"{SCENES[number].__name__.replace('_', ' ')}: {error.invariant}", error.at_s
    return "", 0.0


if __name__ == "__main__":
    sys.exit(search("whole cells in which one certain thing happens", broken))
