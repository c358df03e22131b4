"""The manager dies in the middle of the demo and comes back: the robots wait on their paths and then go on."""

import signal

from live_cell import LiveCell, Process, Recorder

from cell.geometry import Box, body_touches
from cell.messages import ManagerState, Mode, Presence, ProgramState, RobotState, Token


def start_all(live: LiveCell) -> dict[str, Process]:
    processes = {"manager": live.manager()}
    processes |= {gateway: live.gateway(gateway) for gateway in live.settings.gateways}
    return processes | {robot: live.agent(robot) for robot in live.settings.robots}


def enable_and_run(live: LiveCell) -> None:
    with live.client() as session:
        robots = Recorder(session, "robot/*/state")
        for robot in live.settings.robots:
            robots.wait_for(RobotState, lambda s, r=robot: s.robot == r and s.mode is Mode.DISABLED, 60.0, robot)
            live.obeyed("enable", robot)
    for robot in live.settings.robots:
        live.obeyed("run", robot)


def wait_until_inside(live: LiveCell) -> Token:
    """Wait until a robot is in the zone at speed; the token under which it is there."""
    with live.client() as session:
        everything = Recorder(session, "robot/*/state", "manager/state")
        state = everything.wait_for(
            RobotState, lambda s: "handover" in s.zones and (s.tcp_speed_m_s or 0.0) > 0.2, 60.0, "a robot in the zone"
        )
        manager = everything.wait_for(ManagerState, lambda s: s.zones["handover"].token is not None, 5.0, "its token")
        assert manager.zones["handover"].holder == state.robot
        token = manager.zones["handover"].token
        assert token is not None
        return token


def rests_without_manager(state: RobotState) -> bool:
    """The step that ends the braking tells why; the speed is of the newest feedback, a cycle or two older."""
    return state.waiting_for == "the manager is silent" and not state.tcp_speed_m_s


def test_both_robots_brake_on_their_paths_and_both_programs_end_after_the_manager_is_back(live: LiveCell) -> None:
    live.without_repeats("left", "right")
    processes = start_all(live)
    enable_and_run(live)
    (zone,) = live.settings.zones.values()
    box = Box.at(zone.size_m, zone.pose.position_m, zone.pose.quaternion_xyzw)
    old_token = wait_until_inside(live)
    processes["manager"].signal(signal.SIGKILL)
    processes["manager"].wait(5.0)
    # A gateway's link to its agent outlives the manager: there one sees what the robot does meanwhile.
    for robot, settings in live.settings.robots.items():
        with live.client_of(settings.gateway) as session:
            state = Recorder(session, f"robot/{robot}/state").wait_for(
                RobotState, rests_without_manager, 10.0, f"{robot} at rest on its path"
            )
            assert state.mode is Mode.RUNNING
    live.manager()
    done: set[str] = set()
    inside = dict.fromkeys(live.settings.robots, False)
    with live.client() as session:
        everything = Recorder(session, "robot/*/state", "robot/*/presence", "manager/state")

        def look(message: object) -> None:
            match message:
                case RobotState(robot=robot, program=program) if program.state is ProgramState.DONE:
                    done.add(robot)
                case Presence(robot=robot, body=body) if body.known:
                    inside[robot] = body_touches(body, box)
                    assert not all(inside.values()), "both bodies are in the zone"
                case ManagerState(zones=zones):
                    token = zones["handover"].token
                    assert token is None or token >= old_token, "tokens only grow"

        def all_done(_: RobotState) -> bool:
            for message in everything.messages:
                look(message)
            everything.messages.clear()
            return done == set(live.settings.robots)

        everything.wait_for(RobotState, all_done, 90.0, "the end of both programs")
