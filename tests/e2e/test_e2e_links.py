"""Links between real processes that are cut, held in one direction, or slow: nobody is unsafe, and work goes on."""

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import pytest
from link_proxy import TO_CALLER, TO_TARGET, LinkProxy
from live_cell import LiveCell, Process, Recorder, wait_until
from outside_observer import OutsideObserver

from cell.messages import ManagerState, Mode, ProgramState, RobotState, ZoneState

CYCLE_S = 0.01


@dataclass
class Linked:
    """A cell whose left agent reaches the manager and its gateway through proxies."""

    live: LiveCell
    to_manager: LinkProxy
    to_gateway: LinkProxy
    observer: OutsideObserver
    left: Process

    def state(self, robot: str = "left") -> dict[str, object]:
        return self.observer.states.get(robot, (0.0, {"mode": "", "waiting_for": "", "tcp_speed_m_s": None}))[1]


@pytest.fixture
def linked(tmp_path: Path) -> Iterator[Linked]:
    with ExitStack() as stack:
        live = stack.enter_context(LiveCell(tmp_path, CYCLE_S))
        live.without_repeats("left", "right")
        live.manager()
        for gateway in live.settings.gateways:
            live.gateway(gateway)
        to_manager = stack.enter_context(LinkProxy(live.settings.manager_endpoint))
        to_gateway = stack.enter_context(LinkProxy(live.settings.gateways["left_bus"].endpoint))
        live.agent("right")
        # Without gossip: else the agent learns where the others really listen.
        ways = ("-e", to_manager.endpoint, "-e", to_gateway.endpoint, "--cfg", "scouting/gossip/enabled:false")
        left = live.start("robot-agent", str(live.file), "left", "--state-dir", str(live.state_dir), *ways)
        with live.client() as session:
            robots = Recorder(session, "robot/*/state")
            for robot in live.settings.robots:
                robots.wait_for(RobotState, lambda s, r=robot: s.robot == r and s.mode is Mode.DISABLED, 60.0, robot)
                live.obeyed("enable", robot)
        observer = stack.enter_context(OutsideObserver(live.file, CYCLE_S))
        yield Linked(live, to_manager, to_gateway, observer, left)


def until_left_is_inside(linked: Linked) -> None:
    with linked.live.client() as session:
        robots = Recorder(session, "robot/left/state")
        robots.wait_for(
            RobotState, lambda s: "handover" in s.zones and (s.tcp_speed_m_s or 0.0) > 0.2, 60.0, "left in the zone"
        )


def finish(linked: Linked) -> None:
    """Both programs come to their ends, and the observer has seen nothing that must not be."""
    live, done = linked.live, set[str]()
    with live.client() as session:
        robots = Recorder(session, "robot/*/state")
        if linked.state("right")["mode"] == "ready":
            live.obeyed("run", "right")

        def all_done(state: RobotState) -> bool:
            if state.program.state is ProgramState.DONE:
                done.add(state.robot)
            return done == set(live.settings.robots)

        robots.wait_for(RobotState, all_done, 90.0, "the end of both programs")
    assert linked.observer.breaches == []
    assert linked.observer.counts["left in a zone"] > 0
    assert linked.observer.counts["right in a zone"] > 0


def test_an_agent_whose_link_to_the_manager_is_late_and_then_held_back_loses_nothing_and_goes_on(
    linked: Linked,
) -> None:
    linked.live.obeyed("run", "left")
    _waits_in_front_of_the_zone_while_it_hears_its_manager_late(linked)
    _loses_the_zone_to_nobody_while_its_presences_are_held_back(linked)
    finish(linked)


def _waits_in_front_of_the_zone_while_it_hears_its_manager_late(linked: Linked) -> None:
    with linked.live.client_of("left_bus") as session:  # what is said through the delayed link comes late, if at all
        robots = Recorder(session, "robot/left/state")
        linked.to_manager.delay(TO_CALLER, 1.0)
        robots.wait_for(
            RobotState, lambda s: "manager is silent" in s.waiting_for, 20.0, "left, waiting for the manager"
        )
    assert "left in a zone" not in linked.observer.counts
    linked.to_manager.mend()


def _loses_the_zone_to_nobody_while_its_presences_are_held_back(linked: Linked) -> None:
    until_left_is_inside(linked)
    with linked.live.client() as session:
        manager = Recorder(session, "manager/state")
        linked.to_manager.hold(TO_TARGET)
        manager.wait_for(
            ManagerState, lambda s: s.zones["handover"].state is ZoneState.ORPHANED, 10.0, "the orphaned zone"
        )
        linked.live.obeyed("run", "right")
        manager.take()
        manager.wait_for(ManagerState, lambda s: "right" in s.zones["handover"].queue, 60.0, "right in the queue")
        linked.to_manager.mend()
        manager.take()
        manager.wait_for(
            ManagerState,
            lambda s: s.zones["handover"].state in (ZoneState.GRANTED, ZoneState.OCCUPIED),
            20.0,
            "the zone, granted again",
        )


def test_an_agent_cut_off_from_its_gateway_leaves_its_robot_at_rest_on_the_path_and_goes_on(linked: Linked) -> None:
    linked.live.obeyed("run", "left")
    until_left_is_inside(linked)
    linked.to_gateway.cut()
    with linked.live.client() as session:
        robots = Recorder(session, "robot/left/state")
        robots.wait_for(RobotState, lambda s: not s.tcp_speed_m_s, 20.0, "left at rest")
        linked.to_gateway.mend()
        robots.take()
        state = robots.wait_for(
            RobotState, lambda s: s.mode in (Mode.RUNNING, Mode.FAULT, Mode.DISABLED), 20.0, "left, heard again"
        )
    if state.mode is not Mode.RUNNING:
        wait_until(lambda: bring_back(linked), 60.0, "left, running again")
    finish(linked)


def bring_back(linked: Linked) -> bool:
    """One order, as the robot's mode asks for it; true once it runs."""
    mode = linked.state()["mode"]
    orders = {"fault": ("reset", "left"), "disabled": ("enable", "left"), "halted": ("continue", "left")}
    orders |= {"off_path": ("return", "left"), "ready": ("run", "left")}
    if mode in orders:
        linked.live.order(*orders[str(mode)])
    return mode == "running"
