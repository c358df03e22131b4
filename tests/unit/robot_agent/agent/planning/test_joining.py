"""Which moves are planned together: looked at once each, however many they are."""

import numpy as np
import pytest

from robot_agent.agent.planning import joining
from robot_agent.agent.planning.joining import StraightOn
from robot_agent.language import JointStep


def moves(count: int) -> list[JointStep]:
    """Joint moves that go straight on from one another and name one joint each."""
    return [JointStep(k, (0.01 * k, None, None, None, None, None), 1.0) for k in range(1, count + 1)]


def targets_worked_out(count: int, monkeypatch: pytest.MonkeyPatch) -> int:
    calls = []
    target = joining.joint_target
    monkeypatch.setattr(joining, "joint_target", lambda *which: calls.append(which) or target(*which))
    straight = StraightOn(np.zeros(6))
    for number, step in enumerate(moves(count)):
        assert number == 0 or straight.goes_on(step)
        straight.take(step)
    monkeypatch.setattr(joining, "joint_target", target)
    return len(calls)


def test_long_row_of_joint_moves_costs_as_much_for_each_as_a_short_one(monkeypatch: pytest.MonkeyPatch) -> None:
    few, many = (targets_worked_out(count, monkeypatch) for count in (20, 200))
    assert many <= 10.5 * few


def test_joint_moves_go_on_straight_only_in_the_same_direction() -> None:
    straight = StraightOn(np.zeros(6))
    first, second = moves(2)
    straight.take(first)
    assert straight.goes_on(second)
    assert not straight.goes_on(JointStep(2, (0.0, None, None, None, None, None), 1.0))
    assert not straight.goes_on(JointStep(2, (None, 0.1, None, None, None, None), 1.0))


def test_direction_is_not_known_until_all_joints_are_named() -> None:
    straight = StraightOn(None)
    first, second, third = moves(3)
    straight.take(first)
    assert not straight.goes_on(second)
    straight.take(JointStep(2, (0.01, *(0.0,) * 5), 1.0))
    straight.take(second)
    assert straight.goes_on(third)
