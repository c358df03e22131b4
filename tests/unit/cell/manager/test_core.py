"""The manager in a small world on virtual time."""

import gc
from dataclasses import replace

import pytest

from cell.core import Frozen
from cell.manager.records import EstopCleared, EstopLatched, JournalFailed, Stored, ZoneDecided
from cell.messages import (
    AdoptZone,
    ClearZone,
    Command,
    Estop,
    Halt,
    Heard,
    PlannedWay,
    ResetEstop,
    SetEstop,
    Token,
    TokenGone,
    Who,
    ZoneState,
)
from tests.unit.manager_world import INSIDE, OUTSIDE, World, settings

CLEAR, ADOPT = ClearZone("middle", "me"), AdoptZone("middle", "left", "me")


@pytest.fixture
def world() -> World:
    """Both robots have reported and stand outside."""
    return World().run()


@pytest.fixture
def held(world: World) -> World:
    """Left is inside with its grant."""
    world.left.wants = True
    world.run()
    world.left.x = INSIDE
    return world.run()


def orphaned() -> World:
    """Left fell silent inside its zone."""
    world = World().run()
    world.left.wants = True
    world.run()
    world.left.x = INSIDE
    world.run()
    world.left.silent = True
    return world.run(0.5)


def test_who_wants_a_free_zone_gets_it_with_a_token_of_this_epoch(world: World) -> None:
    world.left.wants = True
    world.run()
    assert (world.zone.state, world.zone.holder, world.zone.token) == (ZoneState.GRANTED, "left", Token(7, 1))


def test_a_holder_whose_body_is_inside_occupies_the_zone(held: World) -> None:
    assert held.zone.state is ZoneState.OCCUPIED


def test_who_comes_first_is_served_first_and_the_second_after_the_release(held: World) -> None:
    held.right.wants = True
    held.run()
    assert held.zone.queue == ("right",)
    assert held.zone.holder == "left"
    held.left.x, held.left.wants = OUTSIDE, False
    held.run()
    assert (held.zone.holder, held.zone.token) == ("right", Token(7, 2))


def test_the_place_in_the_queue_is_kept_while_a_robot_keeps_wanting() -> None:
    world = World(settings(("left", "right", "top"))).run()
    world.left.wants = True
    world.run()
    world.top.wants = True
    world.run()
    world.right.wants = True
    world.run()
    assert world.zone.queue == ("top", "right")


def test_a_priority_in_the_cell_file_goes_before_who_came_first() -> None:
    cell = settings(robots=("left", "right", "top"))
    world = World(replace(cell, zones={"middle": replace(cell.zones["middle"], priority={"top": 1})}))
    for robot in (world.left, world.right, world.top):
        robot.wants = True
        world.run()
    assert world.zone.queue == ("top", "right")


@pytest.mark.parametrize("how", ["stops wanting", "silent"])
def test_the_place_in_the_queue_is_lost_by(held: World, how: str) -> None:
    held.right.wants = True
    held.run()
    held.right.wants, held.right.silent = how != "stops wanting", how == "silent"
    held.run(0.5)
    assert held.zone.queue == ()


def test_a_grant_that_the_robot_has_not_heard_of_yet_is_not_taken_back(world: World) -> None:
    world.left.wants = True
    old_echo = world.left.heard
    world.run(0.01)
    assert world.zone.holder == "left"
    world.left.holds.clear()
    world.left.heard = old_echo
    world.left.wants = False
    world.run(0.01)
    assert world.zone.holder == "left"


def test_a_silent_holder_orphans_its_zone_and_nobody_else_gets_it(held: World) -> None:
    held.right.wants = True
    held.left.silent = True
    held.run(0.5)
    assert (held.zone.state, held.zone.holder) == (ZoneState.ORPHANED, "left")
    assert "left fell silent" in held.zone.reason
    held.run(100.0)
    assert held.zone.state is ZoneState.ORPHANED
    assert held.codes().count("zone_orphaned") == 1


def test_a_token_that_goes_is_silence_at_once(held: World) -> None:
    held.left.silent = True
    held.manager.receive(TokenGone("robot", "left", "b1"), held.now)
    held.run(0.01)
    assert held.zone.state is ZoneState.ORPHANED


def test_the_token_of_a_former_boot_says_nothing_about_the_present_one(held: World) -> None:
    held.manager.receive(TokenGone("robot", "left", "b0"), held.now)
    held.left.silent = True
    held.run(0.05)
    assert held.zone.state is ZoneState.OCCUPIED


def test_the_same_boot_that_returns_with_its_token_has_its_zone_again(held: World) -> None:
    held.left.silent = True
    held.run(0.5)
    held.left.silent = False
    held.run()
    assert (held.zone.state, held.zone.holder, held.zone.token) == (ZoneState.OCCUPIED, "left", Token(7, 1))


def test_the_same_boot_that_returns_outside_without_its_token_frees_the_zone(held: World) -> None:
    held.left.silent = True
    held.run(0.5)
    held.left.silent, held.left.wants, held.left.x = False, False, OUTSIDE
    held.run()
    assert held.zone.state is ZoneState.FREE


def test_a_holder_that_returns_without_having_heard_its_grant_still_blocks_the_zone(world: World) -> None:
    world.left.wants = True
    old_echo = world.left.heard
    world.run(0.01)
    world.manager.receive(TokenGone("robot", "left", "b1"), world.now)
    world.left.silent = True
    world.run(0.01)
    world.left.silent, world.left.wants = False, False
    world.left.heard, world.left.holds = old_echo, {}
    world.run(0.01)
    assert (world.zone.state, world.zone.holder) == (ZoneState.ORPHANED, "left")


def test_a_new_boot_inside_does_not_own_the_zone_until_an_operator_says_so(held: World) -> None:
    held.left.restart("b2")
    held.run(0.5)
    assert held.zone.state is ZoneState.ORPHANED
    reply = held.call(ADOPT)
    assert reply.ok
    held.run()
    assert (held.zone.state, held.zone.token) == (ZoneState.OCCUPIED, Token(7, 2))
    assert held.left.holds == {"middle": Token(7, 2)}
    assert held.records == [ZoneDecided("middle", "adopted by left", "me", reply.text)]


def test_a_new_boot_of_the_holder_measured_outside_frees_the_zone(held: World) -> None:
    held.left.restart("b2")
    held.left.x = OUTSIDE
    held.run()
    assert held.zone.state is ZoneState.FREE


def test_a_new_boot_that_does_not_know_where_it_is_frees_nothing(held: World) -> None:
    held.left.restart("b2")
    held.left.x, held.left.known = OUTSIDE, False
    held.run(0.5)
    assert held.zone.state is ZoneState.ORPHANED
    assert "does not know where it is" in held.call(ADOPT).text


def test_a_replaced_boot_is_never_heard_again(held: World) -> None:
    old = held.left.presence()
    held.left.restart("b2")
    held.left.x = OUTSIDE
    held.run()
    held.manager.receive(old, held.now)
    held.run(0.01)
    assert held.state.heard["left"].boot == "b2"
    assert held.zone.state is ZoneState.FREE


def test_an_operator_clears_the_zone_of_a_silent_robot(held: World) -> None:
    held.left.silent, held.right.wants = True, True
    held.run(0.5)
    assert held.call(CLEAR).ok
    held.run()
    assert (held.zone.state, held.zone.holder) == (ZoneState.GRANTED, "right")
    assert held.records == [ZoneDecided("middle", "cleared", "me", "zone middle is free")]


def test_a_zone_is_not_cleared_of_a_body_that_is_measured_inside(held: World) -> None:
    held.left.restart("b2")
    held.run(0.5)
    reply = held.call(CLEAR)
    assert not reply.ok
    assert "left is measured inside" in reply.text


def test_only_the_robot_that_may_be_inside_adopts(held: World) -> None:
    held.left.restart("b2")
    held.run(0.5)
    reply = held.call(AdoptZone("middle", "right", "me"))
    assert not reply.ok
    assert "zone middle: left may be inside, not right alone" in reply.text


def test_a_zone_that_is_held_is_neither_cleared_nor_adopted(held: World) -> None:
    assert "held by left" in held.call(CLEAR).text
    assert "only an orphaned zone" in held.call(ADOPT).text


def test_an_unknown_zone_is_named_with_those_that_exist(world: World) -> None:
    assert world.call(ClearZone("attic", "me")).text == "no zone 'attic'; this cell has middle"


def test_nothing_is_granted_before_every_robot_has_reported() -> None:
    world = World()
    world.left.wants, world.right.silent = True, True
    world.run(1.0)
    assert (world.zone.state, world.zone.holder) == (ZoneState.FREE, None)
    assert world.zone.reason.startswith("no grants before right reported")
    world.right.silent = False
    world.run()
    assert world.zone.holder == "left"


def test_an_operator_may_clear_a_zone_for_a_robot_that_does_not_report() -> None:
    world = World()
    world.left.wants, world.right.silent = True, True
    world.run(1.0)
    assert world.call(CLEAR).ok
    world.run()
    assert world.zone.holder == "left"


def test_grants_are_rebuilt_from_presences_after_a_restart(held: World) -> None:
    held.restart_manager(8, "m2")
    held.run()
    assert (held.zone.state, held.zone.holder, held.zone.token) == (ZoneState.OCCUPIED, "left", Token(7, 1))
    held.left.x, held.left.wants, held.right.wants = OUTSIDE, False, True
    held.run()
    assert (held.zone.holder, held.zone.token) == ("right", Token(8, 1))


def test_a_presence_for_the_former_manager_is_not_fresh_for_the_new_one(held: World) -> None:
    held.left.heard = Heard("m1", 3)
    held.restart_manager(8, "m2")
    held.manager.receive(held.left.presence(), held.now)
    held.manager.step(held.now)
    held.left.silent = True
    held.run(0.5)
    assert held.zone.reason.startswith("no grants before left reported")


def test_a_grant_of_before_a_restart_is_confirmed_only_when_nobody_can_have_a_newer_one(held: World) -> None:
    held.right.x, held.right.holds, held.right.silent = INSIDE, {"middle": Token(7, 9)}, True
    held.restart_manager(8, "m2")
    held.run(0.5)
    assert (held.zone.state, held.zone.holder) == (ZoneState.FREE, None)
    assert held.zone.reason.startswith("no grants before right reported")
    held.right.silent = False
    held.run(0.1)
    assert (held.zone.state, held.zone.holder) == (ZoneState.ORPHANED, "right")
    assert held.state.estops == ()
    held.left.x, held.left.wants = OUTSIDE, False
    held.left.holds.clear()
    held.run()
    assert (held.zone.state, held.zone.holder, held.zone.token) == (ZoneState.OCCUPIED, "right", Token(7, 9))


def test_an_operator_who_saw_the_robot_that_does_not_report_outside_lets_the_other_keep_its_grant(held: World) -> None:
    held.right.silent = True
    held.restart_manager(8, "m2")
    held.run(0.5)
    assert held.call(CLEAR).text == "zone middle waits for right no more"
    held.run()
    assert (held.zone.state, held.zone.holder, held.zone.token) == (ZoneState.OCCUPIED, "left", Token(7, 1))


def test_a_zone_is_cleared_only_after_a_robot_that_fell_silent_had_the_time_to_brake() -> None:
    world = World().run()
    world.left.wants = True
    world.run()
    world.left.x, world.left.moving = INSIDE, True
    world.run()
    world.left.silent = True
    world.manager.receive(TokenGone("robot", "left", world.left.boot), world.now)
    world.run(0.1)
    refused = world.call(CLEAR)
    assert not refused.ok
    assert "left fell silent a moment ago and may still be moving" in refused.text
    world.run(0.7)
    assert world.call(CLEAR).ok


def test_a_zone_is_not_cleared_away_from_a_robot_that_lives_and_may_come_in() -> None:
    world = World().run()
    world.left.wants = True
    world.run()
    world.right.x = INSIDE
    world.run()
    world.right.silent = True
    world.run(1.0)
    assert (world.zone.state, world.zone.holder) == (ZoneState.ORPHANED, "left")
    cleared = world.call(CLEAR)
    assert cleared.ok
    assert cleared.text == "zone middle is left to left, which lives and may come in"
    world.run()
    assert (world.zone.state, world.zone.holder, world.zone.token) == (ZoneState.GRANTED, "left", Token(7, 1))


def test_two_claims_to_one_zone_are_the_operators(held: World) -> None:
    held.right.x = INSIDE
    held.right.holds = {"middle": Token(7, 9)}
    held.restart_manager(8, "m2")
    held.run(0.5)
    assert (held.zone.state, held.zone.holder) == (ZoneState.ORPHANED, "right")
    assert "left and right both claim it" in held.zone.reason
    held.right.x = OUTSIDE
    held.run()
    assert held.zone.state is ZoneState.ORPHANED
    assert held.call(ADOPT).ok


def test_a_robot_that_starts_standing_in_a_zone_blocks_it_without_a_stop() -> None:
    world = World()
    world.left.x = INSIDE
    world.right.wants = True
    world.run(0.5)
    assert world.zone.state is ZoneState.ORPHANED
    assert world.zone.reason.startswith("left is inside without a grant: ")
    assert world.state.estops == ()
    assert world.call(ADOPT).ok


def test_a_robot_that_does_not_know_where_it_is_may_be_everywhere_it_reaches() -> None:
    world = World()
    world.left.x, world.left.known = 0.6, False
    world.right.wants = True
    world.run(0.5)
    assert world.zone.state is ZoneState.ORPHANED
    assert world.zone.reason.startswith("left does not know where it is: ")
    world.left.known = True
    world.run()
    assert world.zone.holder == "right"


def test_a_body_in_the_zone_of_another_is_a_breach_and_stops_the_cell(held: World) -> None:
    held.right.x = INSIDE
    held.run()
    assert held.zone.state is ZoneState.ORPHANED
    reasons = [estop.reason for estop in held.state.estops]
    assert reasons == ["protective stop: right is in zone middle, which belongs to left"]
    assert "right is in zone middle, which belongs to left" in held.state.refused["right"]
    assert held.codes().count("zone_breach") == 1
    held.right.x = OUTSIDE
    held.run()
    assert (held.zone.state, held.zone.holder) == (ZoneState.OCCUPIED, "left")
    assert held.state.refused == {}
    assert len(held.state.estops) == 1


def test_a_moving_body_in_a_free_zone_is_a_breach(world: World) -> None:
    world.left.x, world.left.moving = INSIDE, True
    world.run()
    assert len(world.state.estops) == 1


def test_a_robot_with_another_configuration_gets_no_grants_and_is_told_why(world: World) -> None:
    world.left.digest, world.left.wants = "other", True
    world.run()
    assert world.zone.holder is None
    assert "its configuration other is not the manager's digest" in world.state.refused["left"]


def test_a_robot_that_is_not_configured_gets_no_grants_but_counts_as_a_body() -> None:
    world = World()
    world.robots["stranger"] = type(world.left)("stranger", x=INSIDE)
    world.run()
    assert world.state.refused == {"stranger": "not configured; this cell has left, right"}
    assert world.zone.state is ZoneState.ORPHANED


def test_what_comes_under_names_that_nobody_knows_takes_no_memory() -> None:
    world = World()
    presence = world.left.presence()
    way = PlannedWay("left", "boot", 1, 1, more=False)

    def send(names: range) -> None:
        for number in names:
            world.manager.receive(replace(presence, robot=f"stranger-{number}"), world.now)
            world.manager.receive(replace(way, robot=f"stranger-{number}"), world.now)
        world.run(0.1)

    send(range(300))
    gc.collect()
    before = len(gc.get_objects())
    send(range(300, 1300))
    gc.collect()
    assert len(gc.get_objects()) - before < 500


def test_an_own_freeze_makes_every_presence_old(held: World) -> None:
    held.manager.receive(Frozen(1.0), held.now)
    held.left.silent = held.right.silent = True
    held.run(0.01)
    assert held.zone.state is ZoneState.ORPHANED
    held.left.silent = held.right.silent = False
    held.run()
    assert held.zone.state is ZoneState.OCCUPIED


def test_state_and_geometry_are_repeated_and_changes_come_at_once(world: World) -> None:
    world.states.clear(), world.geometry.clear()
    world.run(1.0)
    assert 19 <= len(world.states) <= 21
    assert len(world.geometry) == 1
    world.states.clear()
    world.left.wants = True
    world.run(0.01)
    assert len(world.states) == 1


def test_an_emergency_stop_is_latched_stored_repeated_and_confirmed_by_name(held: World) -> None:
    held.right.silent = True
    held.run(0.5)
    reply = held.call(SetEstop("e1", "me", "test"))
    assert reply.ok
    assert reply.text == "the emergency stop is set; confirmed by left; NOT confirmed by right"
    assert held.records == [EstopLatched(Estop("e1", True, "me", "test"))]
    held.estops.clear()
    held.run(1.0)
    assert 19 <= len(held.estops) <= 21
    assert held.state.estops == (Estop("e1", True, "me", "test"),)


def test_nothing_is_granted_under_an_emergency_stop(world: World) -> None:
    world.call(SetEstop("e1", "me", "test"))
    world.left.wants = True
    world.run(0.5)
    assert (world.zone.holder, world.zone.reason) == (None, "emergency stop")


def test_only_a_reset_ends_the_stop_and_its_id_never_works_again(world: World) -> None:
    world.manager.receive(Estop("e1", True, "robot left", "test"), world.now)
    world.run(0.5)
    world.manager.receive(Estop("e1", False, "robot left", "test"), world.now)
    world.run(0.5)
    assert len(world.state.estops) == 1
    reply = world.call(ResetEstop("me", ("e1",)))
    cleared = "cleared: the emergency stop by robot left (test); confirmed by left, right"
    assert (reply.ok, reply.text) == (True, cleared)
    assert world.records[-1] == EstopCleared("e1", "me")
    assert not world.call(SetEstop("e1", "me", "again")).ok
    assert world.state.estops == ()


def test_a_reset_clears_the_stops_that_it_names_and_no_others(world: World) -> None:
    world.manager.receive(Estop("first", True, "anna", "trial"), world.now)
    world.run()
    world.manager.receive(Estop("second", True, "bert", "door open, person inside"), world.now)
    reply = world.call(ResetEstop("anna", ("first",)))
    assert not reply.ok
    assert reply.text == (
        "cleared: the emergency stop by anna (trial); "
        "still in force: the emergency stop by bert (door open, person inside); find the cause, then `cell reset`"
    )
    world.run(0.5)
    assert [estop.id for estop in world.state.estops] == ["second"]
    assert (world.left.estop, world.right.estop) == ("second", "second")
    assert EstopCleared("second", "anna") not in world.records
    assert world.call(ResetEstop("anna", ("second",))).ok
    world.run()
    assert (world.state.estops, world.left.estop) == ((), None)


def test_a_stop_under_an_id_that_was_cleared_is_told_and_a_late_copy_is_not(world: World) -> None:
    stop = Estop("e1", True, "the red button", "pressed")
    world.manager.receive(stop, world.now)
    world.run(0.5)
    assert world.call(ResetEstop("me", ("e1",))).ok
    world.manager.receive(stop, world.now)
    world.run(5.0)
    assert "estop_over" not in {event.code for event in world.events}
    world.manager.receive(stop, world.now)
    world.manager.receive(stop, world.now)
    world.run(0.5)
    (alarm,) = (event for event in world.events if event.code == "estop_over")
    assert "stop e1 by the red button is NOT set" in alarm.text
    assert world.state.estops == ()


def test_a_reset_that_names_no_stop_in_force_clears_nothing(world: World) -> None:
    world.manager.receive(Estop("e1", True, "anna", "trial"), world.now)
    world.run()
    reply = world.call(ResetEstop("bert", ("e0",)))
    assert not reply.ok
    assert reply.text.startswith("nothing is cleared; still in force: the emergency stop by anna (trial)")
    assert [estop.id for estop in world.state.estops] == ["e1"]


def test_the_stop_outlives_the_manager(world: World) -> None:
    stop = Estop("e1", True, "me", "test")
    world.restart_manager(8, "m2", Stored(7, (stop,), ("e0",)))
    world.run()
    assert world.state.estops == (stop,)
    assert world.left.estop == "e1"


def test_a_stop_that_the_manager_missed_is_learnt_from_who_stands_under_it(world: World) -> None:
    world.left.estop = "e9"
    world.run()
    assert [estop.id for estop in world.state.estops] == ["e9"]
    assert world.right.estop == "e9"


def test_who_missed_the_end_of_a_stop_is_told_again(world: World) -> None:
    world.call(SetEstop("e1", "me", "test"))
    world.call(ResetEstop("me", ("e1",)))
    world.run(5.0)
    world.left.estop = "e1"
    world.run()
    assert world.left.estop is None
    assert world.state.estops == ()


def test_a_reset_without_a_stop_says_so(world: World) -> None:
    assert world.call(ResetEstop("me", ())).text == "no emergency stop was set"


def test_the_manager_says_who_it_is(world: World) -> None:
    assert world.call(Who()).text == "manager of cell line (boot m1, epoch 7, process 4711)"


def test_a_command_for_others_is_refused(world: World) -> None:
    assert not world.call(Halt()).ok


def test_an_unknown_body_is_not_granted_what_it_wants() -> None:
    world = World()
    world.left.known, world.left.wants = False, True
    world.run(0.5)
    assert (world.zone.holder, world.zone.reason) == (None, "left not referenced")


@pytest.mark.parametrize("order", [ResetEstop("me", ("e1",)), CLEAR, ADOPT], ids=lambda each: each.verb)
def test_an_order_that_releases_something_is_carried_out_within_half_a_second_or_never(order: Command) -> None:
    world = orphaned()
    world.call(SetEstop("e1", "me", "test"))
    old = Heard(world.state.boot, world.state.sequence)
    world.run(0.6)
    for heard, says in ((old, "0.6"), (Heard("another", 1), "no longer known")):
        reply = world.call(order, heard)
        assert not reply.ok
        assert says in reply.text
        assert "nothing was done: look with `cell status`, then give the order again" in reply.text
    assert world.state.estops
    assert world.zone.state is ZoneState.ORPHANED
    assert [record for record in world.records if isinstance(record, EstopCleared | ZoneDecided)] == []


def test_a_manager_that_wakes_up_carries_out_no_order_of_before() -> None:
    world = orphaned()
    request_id = world.ask(CLEAR)
    world.now += 0.3
    world.manager.receive(Frozen(0.3), world.now)
    world.run()
    assert "no longer known" in world.replies[request_id].text
    assert world.zone.state is ZoneState.ORPHANED


def test_a_stop_is_never_refused_for_its_age() -> None:
    world = World()
    world.run()
    assert world.call(SetEstop("e1", "me", "test"), Heard("another", 1)).ok


def test_a_late_presence_of_an_agent_that_was_never_heard_bans_nobody() -> None:
    world = World()
    world.left.owner = 2
    world.run()
    dead = replace(world.left.presence(), boot="b0", owner=1, sequence=900, heard=None)
    world.manager.receive(dead, world.now)
    world.left.wants = True
    world.run()
    assert (world.zone.state, world.zone.holder) == (ZoneState.GRANTED, "left")


def test_an_agent_whose_claim_is_lower_than_before_gets_no_grants_and_is_told_why() -> None:
    world = World()
    world.left.owner = 7
    world.run()
    world.left.restart("b2")
    world.left.owner = 3
    world.left.wants = True
    world.run(0.5)
    assert world.zone.holder is None
    assert "its claim 3 is lower than 7 of before" in world.state.refused["left"]
    assert "start the manager again" in world.state.refused["left"]


def test_a_journal_that_cannot_be_written_is_an_alarm_that_says_what_a_restart_forgets(world: World) -> None:
    world.call(SetEstop("e1", "me", "test"))
    world.manager.receive(JournalFailed("/x: disk is full", tuple(world.records)), world.now)
    world.run()
    alarm = next(event for event in world.events if event.code == "journal_failed")
    assert alarm.text == "the journal cannot be written: /x: disk is full"
    assert "does not know: emergency stop e1, unless a robot or gateway that stands under it is heard" in alarm.remedy
    assert world.state.estops != ()
