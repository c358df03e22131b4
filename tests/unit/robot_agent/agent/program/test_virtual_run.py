"""A program that runs without its robot: a picture in the state, and nothing else."""

from collections.abc import Iterable

import numpy as np
import pytest

from cell.config.settings import SeparationSettings
from cell.core import Effect, Publish
from cell.messages import (
    AnswerFlag,
    Continue,
    Enable,
    Estop,
    ForceInput,
    Halt,
    Jog,
    JogFrame,
    Mode,
    Presence,
    ProgramState,
    Run,
    SetOverride,
    SetpointBlock,
    SetupStatus,
    Severity,
    Step,
    Stop,
)
from robot_agent.agent.virtual.virtual_run import VirtualRun
from tests.unit.agent_runs import INTO_ZONE, SHORT, enabled, ended, running, until
from tests.unit.agent_world import STEP_S, AgentWorld
from tests.unit.measured_world import START, Measured

SWITCHING = "MJ J1=20 F=60\nSET DO gripper\nMJ J1=-20\nIF DO gripper\n  MJ J2=10\nENDIF\nRESET DO gripper\nHOME\nEND"


def virtual(program: str, world: AgentWorld | None = None) -> AgentWorld:
    world = world or enabled(program)
    id = world.call(Run(virtual=True))
    until(world, lambda: id in world.replies)
    assert world.replies[id].ok, world.replies[id]
    return world


def over(world: AgentWorld) -> bool:
    return world.state.virtual is None and "virtual_ended" in [event.code for event in world.events]


def picture(world: AgentWorld) -> list[np.ndarray]:
    """Joints in all states while it ran virtually."""
    return [np.array(state.virtual.joints) for state in world.states if state.virtual is not None]


def nothing_left(world: AgentWorld, since: tuple[int, int]) -> None:
    """Since so many blocks and presences the robot was sent nothing but where it stands, and asked for nothing."""
    blocks, presences = world.blocks[since[0] :], world.presences[since[1] :]
    assert all((block.position == world.played[0]).all() and not block.events for block in blocks)
    assert len({block.sequence for block in blocks}) == len(blocks)
    assert len({each.sequence for each in presences}) == len(presences)
    assert all(each.stop_time_s == 0.0 and not each.wants and each.mode is Mode.READY for each in presences)
    assert world.switched == []


def test_a_virtual_run_moves_a_picture_and_nothing_else() -> None:
    world = enabled(SWITCHING, outputs=("gripper",))
    since = len(world.blocks), len(world.presences)
    virtual(SWITCHING, world)
    until(world, lambda: over(world))
    assert np.ptp(picture(world), axis=0)[0] > 0.3
    nothing_left(world, since)
    assert {state.mode for state in world.states[-100:]} == {Mode.READY}
    assert {state.program.state for state in world.states[-100:]} == {ProgramState.LOADED}
    assert "virtual run of left.prog is done; nothing was moved" in world.events[-1].text


@pytest.mark.parametrize("leaks", [SetpointBlock, Presence])
def test_planted_fault_whatever_the_sink_lets_out_is_seen(monkeypatch: pytest.MonkeyPatch, leaks: type) -> None:
    kept_in = VirtualRun._sink

    def leaky(self: VirtualRun, effects: Iterable[Effect], now: float) -> list[Effect]:
        effects = list(effects)
        out = kept_in(self, effects, now)
        return out + [each for each in effects if isinstance(each, Publish) and isinstance(each.message, leaks)]

    monkeypatch.setattr(VirtualRun, "_sink", leaky)
    world = enabled(SWITCHING, outputs=("gripper",))
    since = len(world.blocks), len(world.presences)
    virtual(SWITCHING, world)
    with pytest.raises(AssertionError):
        _run_out(world, since)


def _run_out(world: AgentWorld, since: tuple[int, int]) -> None:
    until(world, lambda: over(world))
    nothing_left(world, since)


def test_neither_an_emergency_stop_nor_a_set_up_of_another_robot_is_about_the_picture() -> None:
    world = virtual(SHORT)
    world.setup = SetupStatus("right", True)
    world.agent.receive(Estop("e1", True, "ann", "door"), world.now)
    world.run(0.2)
    assert world.state.mode is Mode.ESTOP
    until(world, lambda: over(world))
    assert world.events[-1].severity is Severity.INFO


def test_the_picture_is_what_the_robot_does_when_it_runs() -> None:
    seen, real = virtual(SHORT), running(SHORT)
    until(seen, lambda: over(seen))
    begun = len(real.states)
    until(real, ended(real))
    driven = np.array([state.joints for state in real.states[begun:]])
    for q in picture(seen)[::10]:
        assert np.abs(driven - q).max(axis=1).min() < 0.02  # between two states of a robot that moves


@pytest.mark.parametrize("mode", [Mode.DISABLED, Mode.FAULT, Mode.READY])
def test_a_robot_that_nothing_moves_can_run_virtually_with_its_drives_off_and_in_a_fault_too(mode: Mode) -> None:
    world = AgentWorld(SHORT)
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    if mode is not Mode.DISABLED:
        world.call(Enable())
        until(world, lambda: world.state.mode is Mode.READY)
    if mode is Mode.FAULT:
        world.quick_stop()
        until(world, lambda: world.state.mode is Mode.FAULT)
    virtual(SHORT, world)
    until(world, lambda: over(world))
    assert world.state.mode is mode
    assert world.events[-1].severity is Severity.INFO


def test_a_zone_that_nobody_grants_and_space_that_nobody_clears_do_not_stop_it_and_are_not_asked_for() -> None:
    world = AgentWorld(INTO_ZONE, separation=SeparationSettings(0.03, ()))
    world.clears = 0
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    virtual(INTO_ZONE, world)
    until(world, lambda: over(world))
    assert world.events[-1].severity is Severity.INFO
    assert not any(each.wants or each.holds or len(each.way.sections) > each.way.owned for each in world.presences)


def test_outputs_are_shown_and_not_switched() -> None:
    world = virtual(SWITCHING, enabled(SWITCHING, outputs=("gripper",)))
    until(world, lambda: over(world))
    shown = [state.virtual.outputs for state in world.states if state.virtual is not None]
    assert {"gripper": True} in shown
    assert shown[-1] == {"gripper": False}
    assert max(q[1] for q in picture(world)) > np.radians(9.0)  # IF DO saw what is shown
    assert world.switched == []


def test_real_motion_is_refused_meanwhile_with_the_way_out() -> None:
    world = virtual(SHORT)
    jog = Jog("press", "J1", 0.1, JogFrame.WORLD)
    ids = [world.call(command) for command in (Run(), jog, Run(virtual=True))]
    world.step()
    assert [world.replies[id].ok for id in ids] == [False] * 3
    assert "runs virtually: `cell stop left`" in world.replies[ids[0]].text


def test_halt_continue_step_and_stop_are_about_the_virtual_run() -> None:
    world = virtual(SHORT)
    until(world, lambda: len(picture(world)) > 20)
    world.call(Halt())
    until(world, lambda: world.state.virtual is not None and world.state.virtual.mode is Mode.HALTED)
    world.run(0.5)
    stood = picture(world)[-1]
    world.run(0.2)
    assert (picture(world)[-1] == stood).all()
    world.call(Continue())
    world.run(0.5)
    assert (picture(world)[-1] != stood).any()
    world.call(Step())
    until(world, lambda: world.state.virtual is not None and world.state.virtual.mode is Mode.HALTED)
    id = world.call(Stop())
    until(world, lambda: over(world))
    assert world.replies[id].text.startswith("virtual run: left has ended its program")
    assert "was stopped" in world.events[-1].text
    assert world.unplanned == [] or min(world.unplanned) > 2**39


def test_override_holds_for_the_virtual_run_and_for_what_comes_after() -> None:
    world = enabled(SHORT)
    world.call(SetOverride(0.0))
    virtual(SHORT, world)
    world.run(1.0)
    assert np.ptp(picture(world), axis=0).max() == 0.0
    assert world.state.virtual is not None
    assert world.state.virtual.waiting_for == "override 0 %"
    world.call(SetOverride(50.0))
    until(world, lambda: over(world))
    assert world.state.pace.override == 0.5


def test_a_halted_program_is_not_lost_by_a_virtual_run() -> None:
    world = running(SHORT)
    world.run(0.5)
    world.call(Halt())
    world.run(1.0)
    virtual(SHORT, world)
    until(world, lambda: over(world))
    assert world.state.mode is Mode.HALTED
    world.call(Continue())
    until(world, ended(world))


def test_inputs_are_live_and_forced_ones_count() -> None:
    world = enabled("WAIT DI part\nMJ J1=20\nWAIT DI lid\nMJ J1=0\nEND")
    world.inputs = {"part": False, "lid": False}
    world.run(0.2)
    virtual("", world)
    world.run(1.0)
    assert np.ptp(picture(world), axis=0).max() == 0.0
    assert world.state.virtual is not None
    assert "input part is off" in world.state.virtual.waiting_for
    world.inputs = {"part": True, "lid": False}
    until(world, lambda: picture(world)[-1][0] > np.radians(19.9))
    world.call(ForceInput("lid", True))
    until(world, lambda: over(world))
    assert world.events[-1].severity is Severity.INFO


def test_it_waits_at_a_flag_and_for_nobody_at_a_meeting() -> None:
    world = virtual("MJ J1=10\nMEET load\nM 7\nMJ J1=0\nEND")
    until(world, lambda: world.state.virtual is not None and world.state.virtual.program.flag == 7)
    assert all(each.meets.waits is None for each in world.presences)
    world.call(AnswerFlag(7))
    until(world, lambda: over(world))


def test_a_program_that_cannot_be_planned_ends_it_with_the_reason() -> None:
    world = virtual("MJ J1=20\nML X=9999 F=100\nEND")
    until(world, lambda: over(world))
    assert "has ended early: line 2" in world.events[-1].text
    assert world.state.mode is Mode.READY
    assert world.state.alarms == ()


def test_where_nobody_knows_where_the_robot_is_it_is_refused() -> None:
    world = AgentWorld(SHORT)
    world.referenced = False
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    id = world.call(Run(virtual=True))
    world.step()
    assert "does not know where it is" in world.replies[id].text


def test_what_a_run_refuses_a_virtual_one_refuses_too_and_then_there_is_none() -> None:
    world = enabled(SHORT)
    id = world.call(Run(virtual=True, first_line=99))
    until(world, lambda: id in world.replies)
    assert not world.replies[id].ok
    assert world.replies[id].text.startswith("virtual run: left: ")
    world.call(Run())
    until(world, ended(world))


def test_a_running_robot_does_not_run_virtually() -> None:
    world = running(SHORT)
    id = world.call(Run(virtual=True))
    world.step()
    assert world.replies[id].text == "left is in mode running: halt it first with `cell halt left`"


def test_when_the_claim_is_lost_the_virtual_run_ends() -> None:
    world = virtual(SHORT)
    world.agent.link.lose_claim()
    world.step()
    world.run(1.0)
    assert over(world)
    assert "the claim on the gateway was lost" in world.events[-1].text


def test_a_second_run_takes_no_plan_of_the_first_one() -> None:
    world = enabled(SHORT)
    world.planning_s = 0.5
    virtual(SHORT, world)
    world.call(Stop())
    until(world, lambda: over(world))
    world.events.clear()
    virtual(SHORT, world)
    until(world, lambda: over(world))
    assert world.events[-1].severity is Severity.INFO


def test_a_running_belt_is_followed_live() -> None:
    world = Measured(f"{START}TRACK belt\nWAIT 1\nTRACK OFF\nEND")
    world.belt_m_s = 0.1
    world.until(lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    virtual("", world)
    world.until(lambda: over(world))
    places = np.array([s.virtual.tcp_position_m for s in world.states if s.virtual is not None])
    steps = np.diff(places[:, 0]) / STEP_S
    assert (np.abs(steps - 0.1) < 0.002).sum() > 20
    assert world.events[-1].severity is Severity.INFO
