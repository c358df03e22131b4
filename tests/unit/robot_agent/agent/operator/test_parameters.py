"""What an operator may change at run time: in its range, told to everyone, and from a moment on that makes no jump."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.config.settings import PathWindow
from cell.messages import Enable, ListParameters, Mode, Reply, ResetRobot, Run, SetManual, SetParameter, Severity
from robot_agent.agent.parameters import AS_FILED, PARAMETERS, Filed, NotSet, Parameter, Parameters, Tuning
from robot_agent.trajectory import Limits
from tests.unit.agent_runs import SHORT, enabled, ended, running, until
from tests.unit.agent_world import CYCLE_S, AgentWorld
from tests.unit.six_axis_arm import arm

FILED = Filed(Limits.of(arm().description), PathWindow())
CHAIN = "\n".join(["LABEL again", *(f"MJ J1={angle} F=60 R=5" for angle in range(0, 72, 12)), "GOTO again 4", "END"])


def of_file() -> Parameters:
    parameters = Parameters("left", FILED.window, lambda *_: None)
    parameters.declare(FILED.limits)
    return parameters


def answered(world: AgentWorld, name: str, value: float | None, by: str = "ann@desk") -> Reply:
    id = world.call(SetParameter(name, value, by))
    world.step()
    return world.replies[id]


def driven(world: AgentWorld) -> np.ndarray:
    """The largest speed of each joint [rad/s] at every tick."""
    return np.abs(np.diff(np.array(world.played), axis=0)).max(axis=1) / CYCLE_S


@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda each: each.name)
def test_each_is_declared_with_a_range_that_holds_what_the_files_say(parameter: Parameter) -> None:
    filed = parameter.filed(FILED) / parameter.si
    assert parameter.lowest(FILED) <= filed <= parameter.highest(FILED) * (1.0 + 1e-9)
    assert hasattr(AS_FILED, parameter.field)


@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda each: each.name)
@given(share=st.floats(-0.5, 1.5) | st.sampled_from([0.0, 1.0, math.nan, math.inf]))
def test_exactly_what_lies_in_its_range_is_taken(parameter: Parameter, share: float) -> None:
    parameters = of_file()
    lowest, highest = parameter.lowest(FILED), parameter.highest(FILED)
    value = lowest + share * (highest - lowest) if share not in (0.0, 1.0) else (lowest, highest)[int(share)]
    if lowest <= value <= highest:
        parameters.set(parameter.name, value, "ann", 0.0)
        assert getattr(parameters.now, parameter.field) == pytest.approx(value * parameter.si)
        parameters.now.within(FILED.limits)
        parameters.set(parameter.name, None, "ann", 0.0)
    elif not math.isclose(value, highest):
        with pytest.raises(NotSet, match="found, allowed is"):
            parameters.set(parameter.name, value, "ann", 0.0)
    assert parameters.now == AS_FILED or math.isclose(value, highest)


def test_braking_ramps_may_use_what_they_may_without_it() -> None:
    softer = Tuning(joint_acceleration=0.1, joint_speed=0.3).within(FILED.limits)
    np.testing.assert_allclose(softer.ramp_acceleration_bounds, FILED.limits.ramp_acceleration_bounds, rtol=1e-12)
    np.testing.assert_allclose(softer.ramp_jerk, FILED.limits.ramp_jerk, rtol=1e-12)


def test_what_is_set_is_told_with_who_and_since_when_and_goes_back_to_the_file() -> None:
    world = enabled(SHORT)
    reply = answered(world, "path_speed", 100.0)
    assert reply.text == (
        "left has path_speed 100 mm/s; it counts with the next motion that begins at rest, until "
        "`cell set left path_speed file` or the end of its agent"
    )
    world.run(1.0)
    status = world.state.parameters["path_speed"]
    assert (status.value, status.unit, status.by) == (100.0, "mm/s", "ann@desk")
    assert status.since_s == pytest.approx(1.0, abs=0.05)
    assert [(each.code, each.severity) for each in world.events] == [("parameter_set", Severity.INFO)]
    assert "as its files say" in answered(world, "path_speed", None).text
    assert world.state.parameters == {}


def test_an_unknown_name_and_a_value_out_of_range_are_refused_with_what_is_allowed() -> None:
    world = enabled(SHORT)
    assert answered(world, "path_sped", 1.0).text.startswith("no parameter 'path_sped', allowed path_speed or")
    assert answered(world, "manual_speed", 300.0).text == (
        "manual_speed of left: 300 mm/s found, allowed is 10 to 250 mm/s; it stays as it is"
    )
    assert world.state.parameters == {}


def test_the_list_has_each_with_value_range_and_meaning() -> None:
    world = enabled(SHORT)
    answered(world, "joint_speed", 50.0)
    id = world.call(ListParameters())
    world.step()
    lines = world.replies[id].text.splitlines()
    assert len(lines) == 1 + 2 * len(PARAMETERS)
    (line,) = [each for each in lines if each.startswith("joint_speed")]
    assert " ".join(line.split()) == "joint_speed 50 % 1 to 100 % operate set by ann@desk 0 s ago"


def test_speed_and_filter_shape_the_motions_of_the_next_run() -> None:
    plain, slow = running(SHORT), enabled(SHORT)
    answered(slow, "joint_speed", 50.0)
    answered(slow, "filter", 200.0)
    slow.call(Run())
    until(plain, ended(plain))
    until(slow, lambda: slow.state.program.line == 2)
    motion = slow.planned[0].motion
    assert motion.duration_s > plain.planned[0].motion.duration_s * 1.5
    assert driven(slow)[: len(slow.played) - 5].max() < 0.6 * driven(plain).max()


def test_a_motion_that_runs_is_ended_as_it_was_planned_and_the_next_one_begins_at_rest() -> None:
    world = running(CHAIN)
    world.run(0.5)
    answered(world, "joint_speed", 50.0)
    before = len(world.planned)
    rested = len(world.played)
    until(world, lambda: len(world.planned) > before and world.state.program.line > 0)
    until(world, ended(world), 120.0)
    speeds = driven(world)
    bound = 0.5 * 0.6 * FILED.limits.velocity[0]
    at_rest = rested + int(np.argmax(speeds[rested:] == 0.0))
    assert speeds[rested:at_rest].max() > 1.5 * bound
    assert speeds[at_rest:].max() < 1.05 * bound
    accelerations = np.abs(np.diff(np.array(world.played), n=2, axis=0)) / CYCLE_S**2
    assert (accelerations < 1.01 * world.planner.limits.ramp_acceleration_bounds[1]).all()


def test_manual_speed_counts_at_once() -> None:
    world = running("MJ J1=60 F=100\nML Y=400 F=2000\nEND")
    world.call(SetManual(True))
    answered(world, "manual_speed", 50.0)
    begun = len(world.states)
    world.run(2.0)
    speeds = [state.tcp_speed_m_s or 0.0 for state in world.states[begun + 20 :]]
    assert 0.04 < max(speeds) < 0.0505


def test_the_window_decides_whether_a_stopped_robot_may_go_on() -> None:
    for set_to, mode in ((None, Mode.OFF_PATH), (5.0, Mode.HALTED)):
        world = running(SHORT)
        answered(world, "window_turn", set_to)
        until(world, lambda world=world: world.state.program.line == 2)
        world.quick_stop(beside=math.radians(2.0))
        until(world, lambda world=world: world.state.mode is Mode.FAULT)
        world.call(ResetRobot())
        until(world, lambda world=world: world.state.mode is Mode.DISABLED)
        world.call(Enable())
        until(world, lambda world=world: world.state.mode in (Mode.OFF_PATH, Mode.HALTED))
        assert world.state.mode is mode
