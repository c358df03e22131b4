"""Grants as an agent keeps them: what it takes up, and what it has given up for good."""

from cell.messages import Body, Heard, ManagerState, Token, ZoneGeometry, ZoneState, ZoneStatus
from robot_agent.agent.zones.zone_claims import ZoneClaims
from tests.unit.plain_body import plain_body

TOKEN = Token(5, 1)
BOX = ZoneGeometry("middle", 7, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), ("left",))


def body(x: float) -> Body:
    """One capsule at a place on X."""
    return plain_body((0.1,), (((x, 0.0, 0.0, x, 0.0, 0.1),),), (0.0,), reach_m=2.0)


def granted(sequence: int, heard: int) -> ManagerState:
    status = ZoneStatus(ZoneState.OCCUPIED, "left", TOKEN, (), BOX.version, 0.0)
    echo = {"left": Heard("boot", heard)}
    return ManagerState("test", "m", 5, sequence, 0.0, "digest", echo, {"middle": status})


def test_a_zone_that_is_adopted_before_its_place_is_heard_is_held() -> None:
    claims = ZoneClaims("left", "boot", 0.25)
    claims.sent_presence(1, body(0.0), 0.0)
    claims.heard_state(granted(1, heard=1), 0.1)
    claims.update_holds(0.1, claims.touched(body(0.0)), set())
    assert claims.holds == {"middle": TOKEN}


def test_a_grant_that_was_heard_too_late_to_be_taken_up_is_not_lost_where_the_body_is_inside() -> None:
    claims = ZoneClaims("left", "boot", 0.25)
    claims.sent_presence(1, body(0.0), 0.0)
    claims.heard_state(granted(1, heard=1), 0.3)
    claims.heard_geometry(BOX)
    claims.update_holds(0.3, claims.touched(body(0.0)), set())
    claims.sent_presence(2, body(0.0), 0.3)
    assert claims.holds == {}
    claims.heard_state(granted(2, heard=2), 0.35)
    claims.update_holds(0.35, claims.touched(body(0.0)), set())
    assert claims.holds == {"middle": TOKEN}


def test_a_grant_that_was_not_held_outside_is_given_up_for_good() -> None:
    claims = ZoneClaims("left", "boot", 0.25)
    claims.sent_presence(1, body(3.0), 0.0)
    claims.heard_state(granted(1, heard=1), 0.1)
    claims.heard_geometry(BOX)
    claims.update_holds(0.1, claims.touched(body(3.0)), set())
    claims.sent_presence(2, body(3.0), 0.1)
    claims.heard_state(granted(2, heard=2), 0.15)
    claims.update_holds(0.15, claims.touched(body(3.0)), {"middle"})
    assert claims.holds == {}
