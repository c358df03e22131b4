"""What anyone sees with one subscriber: both robots move, and their bodies are never in the zone together."""

from live_cell import LiveCell, Recorder

from cell.geometry import Box
from cell.geometry.occupied import body_touches_box
from cell.messages import Presence, ProgramState, RobotState


def test_both_robots_move_and_their_bodies_are_never_in_the_zone_together(live: LiveCell) -> None:
    up = live.up("--run")
    up.wait_for_output("all robots enabled", 60.0)
    (zone,) = live.settings.zones.values()
    box = Box.at(zone.size_m, zone.pose.position_m, zone.pose.quaternion_xyzw)
    robots = set(live.settings.robots)
    moved: set[str] = set()
    visited: set[str] = set()
    done: set[str] = set()
    inside = dict.fromkeys(robots, False)

    def look(message: object) -> None:
        match message:
            case RobotState(robot=robot, tcp_speed_m_s=speed, program=program):
                if (speed or 0.0) > 0.05:
                    moved.add(robot)
                if program.state is ProgramState.DONE:
                    done.add(robot)
            case Presence(robot=robot, body=body) if body.known:
                inside[robot] = body_touches_box(body, box)
                if inside[robot]:
                    visited.add(robot)
                assert not all(inside.values()), "both bodies are in the zone"

    with live.client() as session:
        everything = Recorder(session, "**")

        def all_done(_: RobotState) -> bool:
            for message in everything.messages:
                look(message)
            everything.messages.clear()
            return done == robots

        everything.wait_for(RobotState, all_done, 90.0, "the end of both programs")
    assert moved == visited == robots
