"""Corrections in the agent: followed on the path, stopped by name, left at rest, and never into a closed zone."""

from collections.abc import Callable

import numpy as np
import pytest

from cell.geometry import body_touches
from cell.messages import (
    AnswerFlag,
    Continue,
    Enable,
    Estop,
    Halt,
    Mode,
    Run,
    SetManual,
    SetOverride,
    Step,
    ZoneState,
    ZoneStatus,
)
from tests.unit.agent_runs import INTO, near_zone
from tests.unit.agent_world import CYCLE_S, ZONE
from tests.unit.measured_world import START, Measured, shares

SEAM_PROGRAM = START + "TRACK seam\nML Y=280 F=60\nML Y=320 F=60 R=0\nTRACK OFF\nML Y=300 F=100\nEND"
BELT_PROGRAM = START + "TRACK belt\nML Z=1980 F=30\nWAIT 0.2\nML Y=220 F=20\nTRACK OFF\nEND"


def test_a_sensors_offset_is_followed_and_the_next_move_begins_where_it_has_led() -> None:
    world = Measured(SEAM_PROGRAM)
    world.start()
    world.until_line(3)
    taught = world.places()[-1]
    world.offset_m = (0.0, 0.0, 0.01)
    world.until_line(4)
    assert world.state.correction is not None
    assert world.state.correction.name == "seam"
    assert world.state.correction.offset_m == pytest.approx((0.0, 0.0, 0.01), abs=1e-4)
    world.until_line(6)
    assert world.state.correction is None
    places = world.places()
    np.testing.assert_allclose(places[places[:, 1].argmax()], [taught[0], 0.32, taught[2] + 0.01], atol=2e-5)
    world.until(lambda: world.done)
    np.testing.assert_allclose(world.places()[-1], [taught[0], 0.3, taught[2] + 0.01], atol=2e-5)
    assert (shares(world) < 1.01).all()
    assert all(not np.any(block.velocity[-1]) for block in world.blocks)


def test_on_a_belt_the_tool_moves_with_it_over_moves_and_pauses_although_blocks_are_lost() -> None:
    world, rng = Measured(BELT_PROGRAM), np.random.default_rng(3)
    world.belt_m_s = 0.05
    world.start()
    world.until_line(3)

    def lossy(done: Callable[[], bool]) -> None:
        def step() -> bool:
            world.lose_blocks = bool(rng.random() < 0.3)
            return done()

        world.until(step)

    lossy(lambda: world.state.waiting_for.startswith("WAIT") or world.state.program.line == 5)
    lossy(lambda: world.state.program.line == 5)
    place = world.places()[-25:]
    np.testing.assert_allclose(np.diff(place[:, 0]) / CYCLE_S, 0.05, atol=2e-3)
    lossy(lambda: world.done)
    world.lose_blocks = False
    world.until_rest()
    assert (shares(world) < 1.01).all()


def test_on_a_belt_an_input_is_waited_for_and_asked_while_the_tool_moves_with_it() -> None:
    world = Measured(BELT_PROGRAM.replace("WAIT 0.2", "WAIT DI part\nIF DI part\nM 5\nENDIF"))
    world.belt_m_s, world.inputs = 0.05, {"part": False}
    world.start()
    world.until(lambda: world.state.waiting_for.startswith("input part is off"))
    world.run(0.5)
    place = world.places()[-25:]
    np.testing.assert_allclose(np.diff(place[:, 0]) / CYCLE_S, 0.05, atol=2e-3)
    world.inputs = {"part": True}
    world.until(lambda: world.state.program.flag == 5)
    world.call(AnswerFlag(5))
    world.until(lambda: world.done)
    world.until_rest()
    assert (shares(world) < 1.01).all()


def test_an_old_measurement_halts_the_robot_by_name_until_an_operator_continues() -> None:
    world = Measured(SEAM_PROGRAM)
    world.start()
    world.until_line(4)
    world.measured_now = False
    world.until(lambda: world.state.mode is Mode.HALTED, seconds=0.5)
    world.until_rest()
    assert any("correction seam: measured 0.2" in event.text for event in world.events)
    for early in (Continue(), Step()):
        answer = world.answer(early)
        assert not answer.ok
        assert "halt again at once: correction seam: measured" in answer.text
        assert world.state.mode is Mode.HALTED
    world.measured_now = True
    world.run(0.5)
    assert world.state.mode is Mode.HALTED
    world.call(Continue())
    world.until(lambda: world.done)


def test_an_offset_beyond_the_largest_halts_the_robot_by_name_and_never_carries_it_there() -> None:
    world = Measured(SEAM_PROGRAM)
    world.start()
    world.until_line(4)
    height = world.places()[-1][2]
    world.offset_m = (0.0, 0.0, 0.2)
    world.until(lambda: world.state.mode is Mode.HALTED, seconds=1.0)
    world.until_rest()
    assert any("from the path, allowed are 50.0 mm" in event.text for event in world.events)
    assert world.places()[-1][2] < height + 0.05
    assert "allowed are 50.0 mm" in world.answer(Continue()).text
    assert world.state.mode is Mode.HALTED


def test_a_path_that_is_led_from_outside_is_not_gone_back() -> None:
    world = Measured(SEAM_PROGRAM)
    world.start()
    world.until_line(4)
    answer = world.answer(SetOverride(-50.0))
    assert not answer.ok
    assert "follows seam" in answer.text
    assert world.answer(SetOverride(50.0)).ok
    world.until_line(6)
    assert world.answer(SetOverride(-50.0)).ok


def test_without_any_measurement_the_program_halts_at_track() -> None:
    world = Measured(SEAM_PROGRAM)
    world.measured_now = False
    world.start()
    world.until(lambda: world.state.mode is Mode.HALTED)
    assert any(event.text == "correction seam: not measured yet" for event in world.events)


def test_on_a_belt_with_parts_the_program_waits_for_each_and_meets_it() -> None:
    world = Measured(START + "LABEL again\nTRACK pick\nML Z=2000 F=50\nWAIT 0.3\nTRACK OFF\nGOTO again 1\nEND")
    world.belt_m_s = 0.05
    world.start()
    world.until(lambda: world.state.waiting_for == "pick: the next part")
    world.run(0.2)
    taught = world.places()[-1]
    world.part_at = world.now - 0.5
    world.until_line(5)
    world.run(0.2)
    way = world.belt_m_s * (world.now - world.part_at)
    assert world.places()[-1][0] - taught[0] == pytest.approx(way, abs=3e-3)
    world.until(lambda: world.state.waiting_for == "pick: the next part")
    world.part_at = world.now
    world.until(lambda: world.done)


@pytest.mark.parametrize("stop", ["halt", "estop"])
def test_a_stop_brings_a_tool_on_a_running_belt_to_rest_in_the_world(stop: str) -> None:
    world = Measured(BELT_PROGRAM)
    world.belt_m_s = 0.1
    world.start()
    world.until_line(5)
    if stop == "halt":
        world.call(Halt())
    else:
        world.agent.receive(Estop("e", True, "test", "test"), world.now)
    world.until_rest()
    if stop == "halt":
        world.call(Continue())
        world.until(lambda: world.done)
    assert (shares(world) < 1.01).all()


def test_a_program_that_ends_while_it_follows_ends_at_rest_and_can_be_run_again() -> None:
    world = Measured(START + "TRACK belt\nML Y=220 F=50\nEND")
    world.belt_m_s = 0.05
    world.start()
    world.until(lambda: world.done)
    world.until_rest()
    world.run(0.2)
    world.call(Run())
    world.until(lambda: world.state.mode is Mode.RUNNING)
    world.until(lambda: world.done)


def test_a_step_ends_with_its_block_although_the_belt_runs_on() -> None:
    world = Measured(START + "TRACK belt\nML Z=2000 F=60\nML Z=1990 F=60 R=0\nML Y=220\nEND")
    world.belt_m_s = 0.02
    world.until(lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    world.call(Enable())
    world.until(lambda: world.state.mode is Mode.READY)
    heights = []
    for _ in range(3):
        world.call(Step())
        world.until(lambda: world.state.mode is Mode.RUNNING)
        world.until(lambda: world.state.mode is Mode.HALTED)
        world.until_rest()
        heights.append(float(world.places()[-1][2]))
    assert heights[1:] == pytest.approx([2.0, 1.99], abs=2e-5)


def test_manual_speed_bounds_path_and_belt_together() -> None:
    world = Measured(START + "TRACK belt\nML X=1430 F=400\nTRACK OFF\nEND")
    world.belt_m_s = 0.1
    world.start()
    world.until_line(3)
    world.call(SetManual(True))
    begun = len(world.played)
    world.until(lambda: world.done)
    speed = np.linalg.norm(np.diff(world.places()[begun:], axis=0), axis=1) / CYCLE_S
    assert 0.2 < speed.max() < 0.2505


def test_a_correction_leads_into_no_zone_without_a_grant() -> None:
    world = Measured(START + "TRACK wide\nML Y=220 F=2\nTRACK OFF\nEND")
    world.zone = ZoneStatus(ZoneState.OCCUPIED, "right", None, (), 1, world.now)
    world.start()
    world.until_line(3)
    world.offset_m = (1.15, 0.0, -0.5)
    world.until(lambda: "held by right" in world.state.waiting_for)
    box = ZONE.solid()
    assert not any(body_touches(presence.body, box) for presence in world.presences)
    assert "handover" in world.presences[-1].wants
    world.grant()
    world.until(lambda: any(body_touches(p.body, box) for p in world.presences[-3:]))
    assert "handover" in world.presences[-1].holds


def test_a_pause_right_after_track_follows_from_its_start() -> None:
    world = Measured(START + "TRACK belt\nWAIT 3\nML Y=220 F=50\nTRACK OFF\nEND")
    world.belt_m_s = 0.05
    world.start()
    world.until_line(3)
    begun = world.places()[-1]
    world.run(2.0)
    assert world.state.program.line == 3
    assert world.places()[-1][0] - begun[0] == pytest.approx(0.1, abs=0.01)
    assert world.state.correction is not None
    world.until(lambda: world.done)
    assert (shares(world) < 1.01).all()


def test_a_pause_right_after_track_that_is_halted_goes_on_following() -> None:
    world = Measured(START + "TRACK belt\nWAIT 3\nTRACK OFF\nML Y=220 F=50\nEND")
    world.belt_m_s = 0.05
    world.start()
    world.until_line(3)
    world.run(1.0)
    world.call(Halt())
    world.until_rest()
    assert world.state.mode is Mode.HALTED
    world.call(Continue())
    world.run(1.0)
    assert world.state.program.line == 3
    assert not np.allclose(world.places()[-1], world.places()[-100])
    world.until(lambda: world.done)
    assert (shares(world) < 1.01).all()


def test_a_halted_robot_takes_no_part_that_passes() -> None:
    world = Measured(START + "TRACK pick\nML Z=2000 F=50\nTRACK OFF\nEND")
    world.belt_m_s = 0.05
    world.start()
    world.until(lambda: world.state.waiting_for == "pick: the next part")
    world.call(Halt())
    world.run(0.2)
    world.part_at = world.now
    world.run(10.0)
    assert world.answer(Continue()).ok
    world.until(lambda: world.state.waiting_for == "pick: the next part")
    world.part_at = world.now
    world.until(lambda: world.done)


@pytest.mark.parametrize("hindrance", ["override 0", "silent manager"])
def test_a_robot_that_is_kept_from_moving_takes_no_part_that_passes(hindrance: str) -> None:
    world = Measured(START + "TRACK pick\nML Z=2000 F=50\nTRACK OFF\nEND")
    world.belt_m_s = 0.05

    def hinder(hindered: bool) -> None:
        if hindrance == "override 0":
            assert world.answer(SetOverride(0.0 if hindered else 100.0)).ok
        else:
            world.manager_silent = hindered

    world.start()
    world.until(lambda: world.state.waiting_for == "pick: the next part")
    hinder(True)
    world.run(0.5)
    world.part_at = world.now
    world.run(10.0)
    hinder(False)
    world.run(0.5)
    assert world.state.waiting_for == "pick: the next part"
    world.part_at = world.now
    world.until(lambda: world.done)


def test_a_halted_program_does_not_come_to_its_track() -> None:
    world = Measured(START + "WAIT 0.5\nTRACK belt\nML Y=220 F=50\nTRACK OFF\nEND")
    world.belt_m_s = 0.05
    world.start()
    world.until(lambda: "WAIT" in world.state.waiting_for)
    world.call(Halt())
    world.run(12.0)
    assert world.answer(Continue()).ok
    world.until(lambda: world.done)


def test_a_zone_is_given_back_while_a_part_is_waited_for() -> None:
    world = Measured(f"MJ {near_zone()}\nTRACK pick\n{INTO}\nTRACK OFF\nEND")
    world.grant()
    world.start()
    world.until(lambda: world.state.waiting_for == "pick: the next part")
    world.run(0.5)
    assert (world.presences[-1].holds, world.presences[-1].wants) == ({}, {})
    world.belt_m_s = 0.001
    world.part_at = world.now
    world.until(lambda: world.presences[-1].holds != {}, 2.0)
