"""Halts, ways back, steps and jogs at any moment change neither the way of a program nor what it switches."""

import functools
import random

import numpy as np
import pytest
from numpy.typing import NDArray

from cell.messages import (
    AnswerFlag,
    Continue,
    Halt,
    Heard,
    Jog,
    JogFrame,
    JogHeld,
    Mode,
    ProgramState,
    Return,
    Run,
    SetOverride,
    Step,
)
from tests.unit.agent_runs import at_rest, enabled, ended, running, until
from tests.unit.agent_world import STEP_S, AgentWorld
from tests.unit.robot_agent.agent.program.conditional_runs import begun

ALL = """MJ J1=10 R=20
SET DO gripper
MJ J1=10 J2=8
LET n = 0
LABEL l
IF DI part
SUB there
ELSE
MJ J2=-3
ENDIF
RESET DO gripper
WAIT DI part
SET DO gripper
IF NOT DI door
MJ J1=3
ENDIF
M 7
WAIT 0.2
LET n = n + 1
IF n < 2
GOTO l
ENDIF
MJ J1=0 J2=0 J5=30
ML Y=60 F=400 R=10
ML Z=2000
MJ J1=0
END
LABEL there
MJ J1=14
M 5 ASYNC
MJ J1=8
END"""
REACH_M = 3.0
"""No point of the arm is farther from any of its axes."""
SIGNALS = {"part": True, "door": False}
BEGINNING = "at the beginning of what is kept of its path"


def beside_m(played: NDArray[np.float64], plain: AgentWorld) -> float:
    """How far the arm is at most from the way that was planned for an undisturbed run [m]; `played` `(m, n)`."""
    points = np.unique(played, axis=0)
    away = np.full(len(points), np.inf)
    for each in plain.planned:
        way = each.motion.q(np.append(np.arange(0.0, each.motion.duration_s, 1e-4), each.motion.duration_s))
        for some in np.array_split(np.arange(len(points)), 1 + len(points) // 200):
            away[some] = np.minimum(away[some], _from(points[some], way))
    return REACH_M * float(away.max())


def _from(points: NDArray[np.float64], way: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far points `(m, n)` are from the polygon through `(k, n)`, which is looked at around the nearest 20th."""
    near = 20 * np.linalg.norm(points[:, None] - way[::20], axis=-1).argmin(axis=1)
    around = np.clip(near[:, None] + np.arange(-20, 21), 0, len(way) - 1)
    first, ahead = way[around[:, :-1]], np.diff(way[around], axis=1)
    square = (ahead**2).sum(axis=-1)
    along = np.einsum("psk,psk->ps", points[:, None] - first, ahead) / np.where(square > 0.0, square, 1.0)
    away = points[:, None] - first - np.clip(along, 0.0, 1.0)[..., None] * ahead
    nearest: NDArray[np.float64] = np.linalg.norm(away, axis=-1).min(axis=1)
    return nearest


class Disturbed:
    """A run of the program, with what an operator does by the way."""

    def __init__(self, disturbances: random.Random | None) -> None:
        self.world = begun(ALL, outputs=("gripper",), **SIGNALS)
        self._rng = disturbances
        self.led: list[tuple[int, int]] = []
        """Pieces of what was played that are no way of the program: a jog, and the way back."""
        self.did: set[str] = set()

    def run(self) -> "Disturbed":
        world, rng = self.world, self._rng
        deadline = world.now + 200.0
        while world.now < deadline and world.state.program.state is ProgramState.RUNNING:
            if world.state.program.flag == 7:
                world.call(AnswerFlag(7))
            if rng is not None and rng.random() < 0.02:
                rng.choices([self.halt, self.go_back, self.step_back, self.jog], [4, 2, 1, 2])[0]()
            world.step()
        assert world.state.program.state is ProgramState.DONE, (world.state, self.did)
        return self

    @property
    def on_its_way(self) -> NDArray[np.float64]:
        """What was played `(m, n)`, without where it was jogged."""
        keeps = np.ones(len(self.world.played), dtype=bool)
        for first, last in self.led:
            keeps[first:last] = False
        return np.array(self.world.played)[keeps]

    def _for(self, most: int) -> float:
        assert self._rng is not None
        return STEP_S * self._rng.randint(1, most)

    def halt(self) -> None:
        self.did.add("halt")
        self.world.call(Halt())
        self.world.run(self._for(60))
        self._go_on()

    def go_back(self) -> None:
        """Nothing is asked and nothing is switched meanwhile, once the robot has turned."""
        assert self._rng is not None
        self.did.add("back")
        self.world.call(SetOverride(self._rng.choice([-100.0, -60.0])))
        self.world.run(0.7)
        self.world.inputs = dict.fromkeys(SIGNALS)
        switched = len(self.world.switched)
        self.world.run(self._for(50))
        assert len(self.world.switched) == switched
        self._forwards()

    def step_back(self) -> None:
        world = self.world
        self.did.add("step")
        world.call(Halt())
        world.run(0.4)
        if world.state.mode is not Mode.HALTED:
            return
        world.call(SetOverride(-100.0))
        world.call(Step())
        world.step()
        until(world, lambda: world.state.mode is not Mode.RUNNING or BEGINNING in world.state.waiting_for)
        self._forwards()
        self._go_on()

    def jog(self) -> None:
        world = self.world
        world.call(Halt())
        until(world, at_rest(world))
        world.run(0.2)
        if world.state.mode is not Mode.HALTED:
            return
        self.did.add("jog")
        first = len(world.played)
        press = f"press{world.now:.2f}"
        world.call(Jog(press, "J1", -0.2, JogFrame.WORLD))
        for held in (*[True] * 15, *[False] * 15):
            heard = Heard(world.state.boot, world.state.sequence)
            world.agent.receive(JogHeld("left", press, held, heard), world.now)
            world.step()
        assert world.state.mode is Mode.OFF_PATH, world.state
        world.call(Return())
        world.step()
        until(world, lambda: world.state.mode is Mode.HALTED)
        self.led.append((first, len(world.played)))
        self._go_on()

    def _forwards(self) -> None:
        self.world.inputs = dict(SIGNALS)
        self.world.call(SetOverride(100.0))

    def _go_on(self) -> None:
        self.world.call(Continue())


@functools.cache
def plain() -> Disturbed:
    return Disturbed(None).run()


def same(disturbed: Disturbed) -> None:
    assert beside_m(disturbed.on_its_way, plain().world) < 1e-6
    np.testing.assert_allclose(disturbed.world.commanded, plain().world.commanded, atol=1e-9)
    for world in (plain().world, disturbed.world):
        assert [event.value for _, event in world.switched] == [True, False, True, False, True]
        assert world.state.program.raised == {"5": 2}
        assert world.state.program.variables == {"n": 2.0}


@pytest.mark.parametrize("seed", range(1))
def test_nothing_that_an_operator_does_on_the_way_changes_it_or_what_is_switched(seed: int) -> None:
    disturbed = Disturbed(random.Random(seed)).run()
    assert len(disturbed.did) > 2
    same(disturbed)


@pytest.mark.soak
def test_nor_in_a_hundred_runs() -> None:
    for seed in range(100):
        same(Disturbed(random.Random(1000 + seed)).run())


# Back over the motions before the present one


def at_the_flag(world: AgentWorld) -> None:
    until(world, lambda: world.state.program.flag == 7)


def test_it_goes_back_over_waits_branches_and_outputs_to_where_the_program_began() -> None:
    world = begun(ALL, outputs=("gripper",), **SIGNALS)
    at_the_flag(world)
    began, switched = world.planned[0].motion.q(np.array(0.0)), len(world.switched)
    world.call(SetOverride(-100.0))
    world.inputs = dict.fromkeys(SIGNALS)
    until(world, lambda: world.state.waiting_for.endswith(BEGINNING))
    np.testing.assert_allclose(world.commanded, began, atol=1e-9)
    assert world.state.program.line == 1
    assert len(world.switched) == switched
    assert world.state.program.raised == {"5": 1}
    world.call(SetOverride(100.0))
    at_the_flag(world)
    assert len(world.switched) == switched
    assert world.state.program.raised == {"5": 1}
    assert beside_m(np.array(world.played), plain().world) < 1e-6


def test_steps_go_back_block_by_block_over_the_beginning_of_a_motion() -> None:
    world = begun("MJ J1=10\nMJ J1=20\nWAIT DI part\nMJ J1=30\nM 7\nMJ J1=0\nEND", part=True)
    at_the_flag(world)
    world.call(Halt())
    world.run(0.2)
    world.call(SetOverride(-100.0))
    stops = []
    for _ in range(3):
        world.call(Step())
        world.step()
        until(world, lambda: world.state.mode is Mode.HALTED)
        stops.append(round(float(np.degrees(world.commanded[0])), 3))
    assert stops == [20.0, 10.0, 0.0]
    world.call(Step())
    until(world, lambda: world.state.waiting_for.endswith(BEGINNING))


def test_from_a_motion_before_it_can_be_halted_and_its_outputs_ahead_wait() -> None:
    world = enabled("MJ J1=10 F=50\nWAIT 0.1\nMJ J1=20 F=50\nSET DO gripper\nMJ J2=5\nEND", outputs=("gripper",))
    world.call(Run())
    until(world, lambda: world.state.program.line == 3)
    world.run(0.1)
    world.call(SetOverride(-100.0))
    until(world, lambda: world.state.program.line == 1)
    world.call(Halt())
    world.run(1.0)
    assert world.switched == []
    world.call(SetOverride(100.0))
    world.call(Continue())
    until(world, ended(world))
    assert [event.value for _, event in world.switched] == [True]


def test_a_fault_on_the_way_back_is_returned_from_as_any_other() -> None:
    world = running("MJ J1=10\nWAIT 0.1\nMJ J1=20\nEND")
    until(world, lambda: world.state.program.line == 3)
    world.run(0.3)
    world.call(SetOverride(-50.0))
    until(world, lambda: world.state.program.line == 1)
    world.run(0.1)
    world.quick_stop()
    until(world, lambda: world.state.mode is Mode.FAULT)
    assert world.state.program.state is ProgramState.INTERRUPTED
