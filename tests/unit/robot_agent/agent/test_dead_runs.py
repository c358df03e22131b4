"""Late messages of a manager or a gateway that is dead: the living one goes on being heard."""

from dataclasses import replace

from cell.core import Arrived
from cell.messages import ManagerState, Mode, ResetRobot, Token, ZoneState, ZoneStatus
from tests.unit.agent_runs import enabled, until
from tests.unit.agent_world import AgentWorld

PROGRAM = "MJ J1=30\nEND"


def tell(world: AgentWorld, message: object) -> None:
    world.agent.receive(Arrived(message, world.now), world.now)


def test_a_late_state_of_a_manager_that_was_never_heard_grants_nothing_and_bans_nobody() -> None:
    world = enabled(PROGRAM)
    mine = ZoneStatus(ZoneState.GRANTED, "left", Token(4, 1), (), 1, 0.0)
    tell(world, ManagerState("test", "dead", 4, 900, 50.0, "digest", {}, {"handover": mine}))
    assert not world.agent.zones.permitted("handover", world.now)
    world.run(0.1)
    assert world.agent.zones.fresh(world.now)
    assert world.agent.zones.state is not None
    assert world.agent.zones.state.boot == "m"


def test_a_living_manager_of_a_lower_epoch_is_not_believed_and_the_robot_says_what_to_do() -> None:
    world = enabled("MJ J1=30 F=20\nEND")
    tell(world, ManagerState("test", "newer", 9, 1, 0.0, "digest"))
    world.run(0.5)
    assert not world.agent.zones.fresh(world.now)
    assert "one of epoch 5 is heard, which is lower than 9 of before" in world.agent.zones.silence
    assert "start this agent again" in world.agent.zones.silence


def test_late_feedback_of_a_gateway_run_that_died_ends_no_claim_and_bans_nobody() -> None:
    world = enabled(PROGRAM)
    feedback = world.agent.link.feedback
    assert feedback is not None
    for _ in range(5):
        tell(world, replace(feedback, boot="dead", sequence=10**6, owner=3))
        world.run(0.02)
    assert world.state.mode is Mode.READY
    assert world.agent.link.feedback.boot == "gateway"


def test_a_gateway_that_was_started_again_is_claimed_anew() -> None:
    world = enabled(PROGRAM)
    feedback = world.agent.link.feedback
    assert feedback is not None
    world.feedback_lost = True
    for sequence in range(50):
        tell(world, replace(feedback, boot="next", sequence=sequence, owner=0))
        world.run(0.02)
    assert world.agent.link.feedback is None
    world.feedback_lost = False
    world.run(0.2)
    assert world.agent.link.owned is not None


def test_a_fault_outlives_the_loss_of_the_claim() -> None:
    world = enabled("MJ J1=30 F=20\nEND")
    feedback = world.agent.link.feedback
    assert feedback is not None
    world.feedback_lost = True
    until(world, lambda: world.state.mode is Mode.FAULT)
    for sequence in range(50):
        tell(world, replace(feedback, boot="next", sequence=sequence, owner=0))
        world.run(0.02)
    world.feedback_lost = False
    world.run(0.5)
    assert world.agent.link.owned is not None
    assert world.state.mode is Mode.FAULT
    world.call(ResetRobot())
    world.run(0.1)
    assert world.state.mode is Mode.READY
