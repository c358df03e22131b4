"""Programs that ask and count do what their text says (`tests.sim.condition_checker`), however they are halted."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cell.messages import AnswerFlag, Command, ProgramState, RobotState, SimulateInput
from tests.sim.condition_checker import broken
from tests.sim.network import Weather
from tests.sim.operator import PatientOperator
from tests.sim.scenario import BAD
from tests.sim.world import World, load_bundle
from tests.unit.config_world import DRIVES, Copy

PROGRAM = """MJ J1=5 F=30
M 5 ASYNC
MJ J1=6 F=30
WAIT DI part OFF TIMEOUT 60
IF NOT DI part
M 3
MJ J1=10 F=30
ELSE
MJ J1=0 F=30
ENDIF
END"""


@pytest.mark.parametrize("seed", range(5))
def test_a_program_does_what_its_text_says(seed: int) -> None:
    assert broken(seed)[0] == ""


@pytest.mark.soak
def test_so_do_four_hundred() -> None:
    assert [seed for seed in range(400) if broken(seed)[0]] == []


def test_in_a_cell_on_a_bad_network_it_waits_for_the_drives_input_and_the_answer(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    copy.change(DRIVES, "at_stop: keep}", "at_stop: keep}\n    inputs:\n      part: {axis: J6, bit: 20}")
    programs = copy.folder / "two_arms" / "programs"
    (programs / "left.prog").write_text(PROGRAM)
    (programs / "right.prog").write_text("END")
    world = World(load_bundle(copy.folder / "two_arms" / "cell.yaml"), 7, BAD)
    PatientOperator(world)

    def left() -> RobotState:
        return world.seen.robots["left"]

    def until(happened: Callable[[], bool], to: str = "", order: Command | None = None) -> bool:
        """Within 30 s, while an order is given again and again, because the network loses some."""
        for _ in range(60):
            if order is not None:
                world.operate(to, order)
            if world.clock.run_until(world.clock.now + 0.5, lambda: "left" in world.seen.robots and happened()):
                return True
        return False

    assert until(lambda: left().waiting_for.startswith("input part is on, WAIT DI goes on when it is off"))
    assert left().program.waits_s is not None
    assert until(lambda: left().program.flag == 3, "gateway/left_bus", SimulateInput("left", "part", False))
    assert until(lambda: left().program.state is ProgramState.DONE, "robot/left", AnswerFlag(3))
    assert left().program.raised == {"5": 1}
    assert left().joints is not None
    assert np.degrees(left().joints or (0.0,))[0] == pytest.approx(10.0, abs=0.1)


def test_in_a_quiet_cell_an_if_rests_for_little_more_than_the_ways_of_the_messages(tmp_path: Path) -> None:
    """Presence to manager, 50 times per second; its state to the gateway, 20 times; the gateway's state at once."""
    copy = Copy(tmp_path)
    copy.change(DRIVES, "at_stop: keep}", "at_stop: keep}\n    inputs:\n      part: {axis: J6, bit: 20}")
    programs = copy.folder / "two_arms" / "programs"
    asks = "".join(f"MJ J1={value} F=50\nIF DI part\nENDIF\n" for value in (1, 2, 1, 2, 1))
    (programs / "left.prog").write_text(f"{asks}END")
    (programs / "right.prog").write_text("END")
    world = World(load_bundle(copy.folder / "two_arms" / "cell.yaml"), 7, Weather(loss=0.0, double=0.0, late=0.0))
    PatientOperator(world)
    rested: dict[int, float] = {}

    def done() -> bool:
        left = world.seen.robots.get("left")
        if left is not None and left.program.waits_s is not None:
            rested[left.program.line] = max(rested.get(left.program.line, 0.0), left.program.waits_s)
        return left is not None and left.program.state is ProgramState.DONE

    assert world.clock.run_until(world.clock.now + 40.0, done)
    assert sorted(rested) == [2, 5, 8, 11, 14]
    assert max(rested.values()) < 0.23
