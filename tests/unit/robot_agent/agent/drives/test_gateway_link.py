"""What an agent asks its gateway, and asks again."""

from cell.core import Ask, AskDone
from cell.messages import Call, ClaimGrant, DisableDrives, EnableDrives
from robot_agent.agent.drives.gateway_link import GatewayLink


def owning() -> GatewayLink:
    link = GatewayLink("left", "a1", "d", "bus")
    link.grant = ClaimGrant(7, 0.004, 1, ("J1",), "g1")
    return link


def asked(effect: object) -> tuple[str, Call]:
    assert isinstance(effect, Ask)
    assert isinstance(effect.call, Call)
    return effect.ask_id, effect.call


def test_switching_on_may_take_long_so_the_same_call_is_repeated_until_its_time_is_over() -> None:
    link = owning()
    ask_id, call = asked(link.switch(EnableDrives("left", 7), "r"))
    for _ in range(3):
        assert link.done(AskDone(ask_id, None, "no answer")) is None
        assert link.switching_on
        [again] = link.claim_if_due(0.0)
        ask_id, repeated = asked(again)
        assert repeated == call
    outcome = link.done(AskDone(ask_id, None, "no answer"))
    assert outcome is not None
    assert (outcome[0].request_id, outcome[1:]) == ("r", (False, "no answer"))
    assert not link.switching_on
    assert link.claim_if_due(0.0) == []


def test_switching_off_is_quick_and_not_repeated() -> None:
    link = owning()
    ask_id, _ = asked(link.switch(DisableDrives("left", 7)))
    assert link.done(AskDone(ask_id, None, "no answer")) is not None
