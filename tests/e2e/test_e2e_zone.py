"""The demo to its end, and what anyone sees of it with one subscriber: bodies are never in the zone together."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from live_cell import SHIPPED_CYCLE_S, LiveCell, Recorder, change, wait_until

from cell.geometry import Box, body_touches
from cell.messages import Presence, ProgramState, RobotState


@pytest.fixture
def live(tmp_path: Path) -> Iterator[LiveCell]:
    """The demo as it is shipped."""
    with LiveCell(tmp_path, SHIPPED_CYCLE_S) as cell:
        yield cell


class Onlooker:
    """Hears every message of a cell with one zone."""

    def __init__(self, live: LiveCell) -> None:
        (zone,) = live.settings.zones.values()
        self._box = Box.at(zone.size_m, zone.pose.position_m, zone.pose.quaternion_xyzw)
        self._inside = dict.fromkeys(live.settings.robots, False)
        self.moved: set[str] = set()
        self.visited: set[str] = set()
        self.done: set[str] = set()

    def look(self, message: object) -> None:
        match message:
            case RobotState(robot=robot, tcp_speed_m_s=speed, program=program):
                if (speed or 0.0) > 0.05:
                    self.moved.add(robot)
                if program.state is ProgramState.DONE:
                    self.done.add(robot)
            case Presence(robot=robot, body=body) if body.known:
                self._inside[robot] = body_touches(body, self._box)
                if self._inside[robot]:
                    self.visited.add(robot)
                assert not all(self._inside.values()), "both bodies are in the zone"


def test_both_programs_run_to_their_end_and_bodies_are_never_in_the_zone_together(live: LiveCell) -> None:
    live.without_repeats("left", "right")
    # So long in the zone that left has to wait for it, however late one of the two begins.
    change(live.settings.robots["right"].program, {"WAIT 0.3": "WAIT 4"})
    up = live.up("--until-done")
    up.wait_for_output("all robots enabled", 60.0)
    onlooker = Onlooker(live)
    with live.client() as session:
        everything = Recorder(session, "**")

        def ended() -> bool:
            is_over = up.exit_code() is not None
            for message in everything.take():
                onlooker.look(message)
            everything.messages.clear()
            return is_over

        wait_until(ended, 120.0, "the end of `cell up --until-done`")
    assert up.exit_code() == 0, up.output
    assert onlooker.moved == onlooker.visited == onlooker.done == set(live.settings.robots)
    assert re.search(r"all robots enabled after \d+\.\d s", up.output)
    assert re.search(r"robot (left|right) stood still for \d+\.\d s until zone handover was free", up.output)
    assert "stood still for 0.0 s" not in up.output
