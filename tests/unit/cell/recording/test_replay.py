"""A replay tells at each moment what was heard by then."""

from dataclasses import replace
from pathlib import Path

import pytest

from cell.messages import Event, Severity
from cell.messages.frame import FramePose
from cell.recording.reader import Recorded
from cell.recording.replay import Replay
from tests.unit.cell.recording.recordings import BEGIN, record

EVENT = Event("manager", 0, Severity.INFO, "code", "text")
FRAME = FramePose("table", 0, None, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def recorded(tmp_path: Path) -> Recorded:
    """A frame each second and an event after each, ten times."""
    heard = [(replace(FRAME, version=i), BEGIN + i) for i in range(10)]
    events = [(replace(EVENT, sequence=i), BEGIN + i + 0.5) for i in range(10)]
    return Recorded(record(tmp_path / "a.mcap", sorted([*heard, *events], key=lambda each: each[1])))


def numbers(replay: Replay) -> tuple[list[int], list[int]]:
    """Versions and sequences that are new."""
    new = [each.message for each in replay.take_new()]
    versions = [each.version for each in new if isinstance(each, FramePose)]
    return versions, [each.sequence for each in new if isinstance(each, Event)]


def test_states_are_the_newest_and_events_are_all(recorded: Recorded, clock: Clock) -> None:
    replay = Replay(recorded, 1.0, clock)
    assert numbers(replay) == ([0], [])
    clock.now += 3.6
    assert numbers(replay) == ([3], [0, 1, 2, 3])
    assert numbers(replay) == ([], [])
    assert replay.now() == BEGIN + 3.6


def test_it_goes_as_fast_as_it_is_told_and_stands_at_the_end(recorded: Recorded, clock: Clock) -> None:
    replay = Replay(recorded, 10.0, clock)
    clock.now += 0.5
    assert replay.now() == BEGIN + 5.0
    replay.pace(0.0)
    clock.now += 50.0
    assert replay.now() == BEGIN + 5.0
    assert not replay.ended
    replay.pace(2.0)
    clock.now += 50.0
    assert replay.now() == BEGIN + 9.5
    assert numbers(replay) == ([9], list(range(10)))
    assert replay.ended


@pytest.mark.parametrize(("to", "state", "events"), [(4.0, [4], [3]), (-9.0, [0], []), (99.0, [9], [8, 9])])
def test_a_seek_tells_the_state_of_that_moment(
    recorded: Recorded, clock: Clock, to: float, state: list[int], events: list[int]
) -> None:
    replay = Replay(recorded, 1.0, clock)
    clock.now += 7.0
    replay.take_new()
    replay.seek(BEGIN + to)
    assert numbers(replay) == (state, events)
