"""The simulated world does what real networks, computers and operators do."""

import hashlib
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import pytest

from cell.commands.checks import CellBundle
from cell.core import Frozen, Request
from cell.messages import (
    STATES,
    DriveFeedback,
    Enable,
    Estop,
    Halt,
    ManagerState,
    Mode,
    PlayoutState,
    Presence,
    Reply,
    ResetEstop,
    RobotState,
    Run,
    SetEstop,
    SetOverride,
    TokenGone,
    Who,
)
from cell.net.codec import encode
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.nmt import SYNC_FRAME
from drive_gateway.sim.drives.power_state import DriveState
from robot_agent.agent.planning.plans import PlanRequest
from robot_agent.language import JointStep
from tests.sim.bus import SimPort
from tests.sim.clock import Clock
from tests.sim.exchange import LEASE_S
from tests.sim.host import Host
from tests.sim.judge import Judge
from tests.sim.judge.facts import Sample
from tests.sim.network import Weather
from tests.sim.planning_worker import SimWorker
from tests.sim.world import World, load_bundle
from tests.unit.message_kinds import same

CALM = Weather(loss=0.0, double=0.0, late=0.0)
LEFT, LEFT_BUS = "robot/left", "gateway/left_bus"

T = TypeVar("T")


class Told:
    """What one core was handed, and when."""

    def __init__(self, world: World, process: str) -> None:
        self._clock = world.clock
        self._process = process
        self.messages: list[tuple[float, object]] = []
        world.on_delivered.append(self._look)

    def _look(self, process: str, message: object) -> None:
        if process == self._process:
            self.messages.append((self._clock.now, message))

    def of(self, kind: type[T], since: float = 0.0) -> list[T]:
        return [message for at, message in self.messages if isinstance(message, kind) and at >= since]


def calm(bundle: CellBundle, seed: int = 1, weather: Weather = CALM) -> World:
    """Everybody has heard everybody."""
    world = World(bundle, seed, weather)
    until(world, lambda: {mode(world, robot) for robot in world.cell.robots} == {Mode.DISABLED})
    return world


def mode(world: World, robot: str = "left") -> Mode | None:
    state = world.seen.robots.get(robot)
    return None if state is None else state.mode


def run(world: World, seconds: float) -> None:
    world.clock.run_until(world.clock.now + seconds)


def until(world: World, happened: Callable[[], bool], within_s: float = 20.0) -> None:
    assert world.clock.run_until(world.clock.now + within_s, happened), world.seen.said


def moving(bundle: CellBundle) -> World:
    """The left robot is on its way."""
    world = calm(bundle)
    world.operate(LEFT, Enable())
    until(world, lambda: mode(world) is Mode.READY)
    world.operate(LEFT, Run())
    until(world, lambda: float(np.abs(world.seen.feedback["left"].velocity).max()) > 0.3)
    return world


def places(world: World) -> list[float]:
    return [drive.position for node in world.buses[LEFT_BUS].nodes.values() for drive in node.drives]


# What is sent


def test_messages_go_through_the_codec(bundle: CellBundle) -> None:
    world = World(bundle, 1, CALM)
    sent: list[object] = []
    world.on_published.append(lambda process, message: sent.append(message) if process == LEFT else None)
    told = Told(world, "manager")
    until(world, lambda: len([p for p in told.of(Presence) if p.robot == "left"]) > 2)
    heard = [presence for presence in told.of(Presence) if presence.robot == "left"]
    by_sequence = {presence.sequence: presence for presence in sent if isinstance(presence, Presence)}
    for presence in heard:
        assert same(presence, by_sequence[presence.sequence])
        assert presence is not by_sequence[presence.sequence]


def test_everything_that_processes_send_is_shown_when_it_leaves(bundle: CellBundle) -> None:
    world, kinds = World(bundle, 1, CALM), set()
    world.on_published.append(lambda process, message: kinds.add((process.partition("/")[0], type(message).__name__)))
    until(world, lambda: mode(world) is Mode.DISABLED)
    assert {("robot", "Presence"), ("robot", "Call"), ("gateway", "Reply"), ("gateway", "DriveFeedback")} <= kinds
    assert {("manager", "ManagerState"), ("manager", "ZoneGeometry"), ("robot", "SetpointBlock")} <= kinds


def test_agents_and_gateways_hear_what_their_real_shells_subscribe_to_and_nothing_else(bundle: CellBundle) -> None:
    world = World(bundle, 1, CALM)
    heard: dict[str, set[str]] = {}
    state_kinds = {kind.__name__ for kind in STATES}
    world.on_delivered.append(lambda process, message: heard.setdefault(process, set()).add(type(message).__name__))
    until(world, lambda: mode(world) is Mode.DISABLED)
    run(world, 1.0)
    assert heard[LEFT] & state_kinds == {"ManagerState", "ZoneGeometry", "DriveFeedback", "GatewayState"}
    assert heard[LEFT_BUS] & state_kinds == {"ManagerState", "SetpointBlock"}
    assert heard["manager"] & state_kinds == {"Presence", "GatewayState"}


def test_the_same_seed_gives_the_same_run_bit_for_bit_with_all_faults(bundle: CellBundle) -> None:
    def digest() -> str:
        world, found = World(bundle, 5, Weather(loss=0.2, double=0.05, late=0.05)), hashlib.sha256()
        world.on_published.append(
            lambda process, message: (
                found.update(process.encode() + encode(message)) if type(message) in STATES else None
            )
        )
        run(world, 0.7)
        world.freeze("manager", 0.6)
        world.kill(LEFT)
        world.network.delay("*", "manager", 0.5, 0.3)
        run(world, 0.5)
        world.start(LEFT)
        world.kill(LEFT_BUS)
        world.journal.lose()
        run(world, 0.7)
        world.start(LEFT_BUS)
        world.network.partition({"manager", "robot/right"}, 0.8)
        run(world, 1.5)
        return found.hexdigest()

    assert digest() == digest()


# Links


def test_a_cut_stops_one_direction_only(bundle: CellBundle) -> None:
    world = calm(bundle)
    manager, agent = Told(world, "manager"), Told(world, LEFT)
    world.network.cut(LEFT, "manager", 1.0)
    begin = world.clock.now
    run(world, 1.0)
    assert {presence.robot for presence in manager.of(Presence, begin + 0.2)} == {"right"}
    assert len(agent.of(ManagerState, begin + 0.2)) > 10
    run(world, 0.2)
    assert {presence.robot for presence in manager.of(Presence, begin + 1.0)} == {"left", "right"}


def test_a_partition_cuts_both_directions_until_it_heals(bundle: CellBundle) -> None:
    world = calm(bundle)
    manager, left, right = Told(world, "manager"), Told(world, LEFT), Told(world, "robot/right")
    world.network.partition({LEFT, LEFT_BUS}, 60.0)
    begin = world.clock.now
    run(world, 1.0)
    assert not left.of(ManagerState, begin + 0.2)
    assert {presence.robot for presence in manager.of(Presence, begin + 0.2)} == {"right"}
    assert left.of(DriveFeedback, begin + 0.2)
    assert right.of(ManagerState, begin + 0.2)
    world.network.heal()
    run(world, 0.2)
    assert left.of(ManagerState, begin + 1.0)


def test_a_delayed_message_of_a_killed_boot_arrives_after_those_of_its_successor(bundle: CellBundle) -> None:
    world = calm(bundle)
    manager = Told(world, "manager")
    old = world.processes[LEFT].boot
    world.network.delay(LEFT, "manager", 4.0, 0.1)
    run(world, 0.1)
    world.kill(LEFT)
    world.start(LEFT)
    run(world, 4.2)
    boots = [presence.boot for presence in manager.of(Presence) if presence.robot == "left"]
    new = world.processes[LEFT].boot
    assert old in boots[boots.index(new) :]


def test_a_burst_loses_more_for_a_while(bundle: CellBundle) -> None:
    world = calm(bundle)
    manager = Told(world, "manager")

    def heard_in(seconds: float) -> int:
        begin = world.clock.now
        run(world, seconds)
        return len(manager.of(Presence, begin))

    before = heard_in(1.0)
    world.network.burst(0.9, 1.0)
    during = heard_in(1.0)
    assert during < 0.3 * before
    assert heard_in(1.0) > 0.9 * before


# Life and death


def test_a_process_that_wakes_finds_old_messages_and_learns_that_it_was_frozen(bundle: CellBundle) -> None:
    world = calm(bundle)
    manager = Told(world, "manager")
    begin = world.clock.now
    world.freeze("manager", 2.0)
    run(world, 1.9)
    assert not manager.of(object, begin + 0.02)
    sent = [0]
    world.on_published.append(lambda _, message: sent.append(message.sequence) if is_left(message) else None)
    run(world, 0.12)
    woken = [message for at, message in manager.messages if at >= begin + 2.0]
    assert isinstance(woken[0], Frozen)
    (found,) = [presence for presence in woken[:6] if is_left(presence)]
    # One slot per key, and nothing came after the link was given up: it is one and a half seconds old.
    assert (sent[1] - found.sequence) * 0.02 == pytest.approx(1.9 - LEASE_S, abs=0.1)


def is_left(message: object) -> bool:
    return isinstance(message, Presence) and message.robot == "left"


def test_a_short_freeze_leaves_the_newest_message_of_each_key(bundle: CellBundle) -> None:
    world = calm(bundle)
    manager = Told(world, "manager")
    begin = world.clock.now
    world.freeze("manager", 0.4)
    run(world, 0.402)
    woken = [message for at, message in manager.messages if at >= begin + 0.4]
    assert [presence.robot for presence in woken if isinstance(presence, Presence)].count("left") == 1


def test_life_and_death_are_told(bundle: CellBundle) -> None:
    world, lives = World(bundle, 1, CALM), []
    world.on_life.append(lambda process, what: lives.append((process, what)))
    world.start("manager")
    assert not lives, "start of a living process does nothing"
    boot = world.processes["manager"].boot
    world.freeze("manager", 0.1)
    run(world, 0.2)
    world.kill("manager")
    world.kill("manager")
    world.start("manager")
    assert [what for _, what in lives] == ["frozen", "thawed", "killed", "started"]
    assert world.processes["manager"].boot != boot


def test_a_process_that_is_stopped_leaves_in_order(bundle: CellBundle) -> None:
    world, lives = moving(bundle), []
    world.on_life.append(lambda process, what: lives.append((process, what)))
    world.stop(LEFT)
    until(world, lambda: (LEFT, "ended") in lives)
    assert not np.abs(world.seen.feedback["left"].velocity).max() > 0.01
    world.stop(LEFT_BUS)
    until(world, lambda: (LEFT_BUS, "ended") in lives)
    assert {node.state for node in world.buses[LEFT_BUS].nodes.values()} == {DriveState.SWITCH_ON_DISABLED}


def test_the_drives_of_a_killed_gateway_stop_and_a_restarted_one_finds_them_so(bundle: CellBundle) -> None:
    world = moving(bundle)
    world.kill(LEFT_BUS)
    run(world, 1.0)
    stopped = places(world)
    run(world, 0.5)
    assert places(world) == stopped
    states = {node.state for node in world.buses[LEFT_BUS].nodes.values()}
    assert DriveState.OPERATION_ENABLED not in states
    assert DriveState.FAULT in states
    world.start(LEFT_BUS)
    until(world, lambda: "left_bus" in world.seen.gateways and world.seen.gateways["left_bus"].ready)
    assert places(world) == stopped


def test_a_bus_that_carries_nothing_keeps_no_drive_from_moving_on_by_itself() -> None:
    world = moving(load_bundle())
    bus = world.buses[LEFT_BUS]
    bus.broken = True
    for _ in range(10):
        run(world, 0.05)
        assert all(world.clock.now - node.now < 2.0 * bus.STEP_S for node in bus.nodes.values())


def test_a_sample_knows_who_spoke_for_the_robot_when_it_was_taken(bundle: CellBundle) -> None:
    world = World(bundle, 1, CALM)
    facts, samples = Judge(world, only=()).facts, list[Sample]()
    until(world, lambda: mode(world) is Mode.DISABLED)
    run(world, 0.5)
    facts.on_samples = samples.append
    facts.take_sample()
    world.kill(LEFT)
    facts.take_sample()
    world.start(LEFT)
    facts.take_sample()
    facts.flush()
    assert [sample.spoken_for for sample in samples if sample.robot == "left"] == [True, False, False]


def test_frames_take_their_time_on_the_wire() -> None:
    world = calm(load_bundle())
    world.kill(LEFT_BUS)
    port, frames = SimPort(world.buses[LEFT_BUS], world.clock), list[CanFrame]()
    port.opened(None, frames.append, print)
    port.take()
    frames.clear()
    port.send(SYNC_FRAME)
    port.take()
    assert not frames
    run(world, 0.004)
    port.take()
    assert len([frame for frame in frames if 0x180 < frame.id < 0x200]) == len(world.buses[LEFT_BUS].nodes)


def test_a_gateway_that_freezes_for_longer_than_its_limit_finds_a_late_cycle(bundle: CellBundle) -> None:
    world = moving(bundle)
    world.freeze(LEFT_BUS, 1.5)
    until(world, lambda: world.seen.feedback["left"].state is PlayoutState.FAULT)
    assert "late_cycle" in {event.code for event in world.seen.events}


def test_a_process_of_another_configuration_is_refused_and_gives_up(bundle: CellBundle) -> None:
    world, lives = calm(bundle), []
    world.on_life.append(lambda process, what: lives.append((process, what)))
    world.kill(LEFT)
    world.start(LEFT, digest="another")
    until(world, lambda: (LEFT, "ended") in lives)
    assert any(process == LEFT and "configuration" in text for process, text in world.seen.said)


# Tokens


def tokens(world: World) -> set[str]:
    return {alive.name for alive in world.processes["manager"].session.tokens.alive()}


def test_the_token_of_a_process_that_dies_goes_at_once(bundle: CellBundle) -> None:
    world = calm(bundle)
    manager = Told(world, "manager")
    assert "left" in tokens(world)
    boot = world.processes[LEFT].boot
    world.kill(LEFT)
    run(world, 0.05)
    assert manager.of(TokenGone) == [TokenGone("robot", "left", boot)]


@pytest.mark.parametrize("frm", [LEFT, "manager"])
def test_a_token_goes_with_a_link_that_is_cut_for_longer_than_its_lease_and_comes_back(
    bundle: CellBundle, frm: str
) -> None:
    world = calm(bundle)
    manager = Told(world, "manager")
    to = "manager" if frm == LEFT else LEFT
    world.network.cut(frm, to, 0.3)
    run(world, 1.0)
    assert not manager.of(TokenGone)
    world.network.cut(frm, to, 1.0)
    run(world, 0.4)
    assert not manager.of(TokenGone)
    run(world, 0.5)
    assert [gone.name for gone in manager.of(TokenGone)] == ["left"]
    run(world, 0.6)
    assert "left" in tokens(world)


def test_a_token_goes_with_a_process_that_is_frozen_for_longer_than_its_lease(bundle: CellBundle) -> None:
    world = calm(bundle)
    manager = Told(world, "manager")
    world.freeze(LEFT, 0.4)
    run(world, 1.0)
    assert not manager.of(TokenGone)
    world.freeze(LEFT, 1.0)
    run(world, 0.8)
    assert [gone.name for gone in manager.of(TokenGone)] == ["left"]
    run(world, 0.6)
    assert "left" in tokens(world)


# Queues and calls


def test_a_full_inbox_drops_and_counts(bundle: CellBundle) -> None:
    world = calm(bundle)
    manager = Told(world, "manager")
    world.freeze("manager", 0.3)
    for number in range(300):
        world.publish(Estop(f"e{number}", False, "stranger", ""), "stranger")
    run(world, 0.4)
    assert len(manager.of(Estop)) == 256
    assert world.processes["manager"].shell._estops.dropped == 44


def test_a_repeated_call_is_carried_out_once_and_answered_each_time(bundle: CellBundle) -> None:
    world = calm(bundle)
    manager, replies = Told(world, "manager"), []
    for _ in range(3):
        world.operate("manager", Who(), then=replies.append, call_id="again")
        run(world, 0.1)
    assert len(manager.of(Request)) == 1
    assert len(replies) == 3
    assert replies[0] == replies[1] == replies[2]


def test_a_call_that_the_network_doubles_is_carried_out_once(bundle: CellBundle) -> None:
    world = calm(bundle, weather=Weather(loss=0.0, double=1.0, late=0.0))
    manager, replies = Told(world, "manager"), []
    world.operate("manager", Who(), then=replies.append)
    run(world, 0.2)
    assert len(manager.of(Request)) == 1
    assert len(replies) == 1


def test_a_call_ends_once_whatever_becomes_of_it(bundle: CellBundle) -> None:
    world, outcomes = calm(bundle), list[Reply | None]()
    world.kill("manager")
    world.operate("manager", Who(), then=outcomes.append)
    run(world, 0.1)
    assert outcomes == [None]
    assert "nobody answers" in world.seen.said[-1][1]
    world.network.cut(LEFT, "operator", 1.0)
    world.operate(LEFT, Halt(), timeout_s=0.5, then=outcomes.append)
    run(world, 1.5)
    assert outcomes == [None, None]
    assert "this may have been carried out" in world.seen.said[-1][1]


def test_who_dies_while_asked_leaves_no_answer(bundle: CellBundle) -> None:
    world, outcomes = calm(bundle), list[Reply | None]()
    world.network.delay("operator", "manager", 0.3, 0.1)
    world.operate("manager", Who(), then=outcomes.append)
    run(world, 0.1)
    world.kill("manager")
    run(world, 0.1)
    assert outcomes == [None]


# Operators


def test_an_operator_echoes_what_this_operator_has_heard(bundle: CellBundle) -> None:
    world, outcomes = calm(bundle), list[Reply | None]()
    world.operator("second")
    run(world, 0.2)
    world.network.delay(LEFT, "second", 1.0, 60.0)
    run(world, 0.9)
    for by in ("operator", "second"):
        world.operate(LEFT, SetOverride(50.0), by, then=outcomes.append)
    run(world, 1.2)
    fresh, old = outcomes
    assert fresh is not None
    assert fresh.ok
    assert old is not None
    assert not old.ok


def test_an_emergency_stop_goes_through_the_doors_that_are_open(bundle: CellBundle) -> None:
    world = calm(bundle)
    heard = {name: Told(world, name) for name in ("manager", LEFT, LEFT_BUS)}
    world.kill("manager")
    stop = Estop("e1", True, "operator", "test")
    world.raise_estop(stop, doors=("gateways",))
    run(world, 0.3)
    assert stop in heard[LEFT_BUS].of(Estop)
    assert not heard[LEFT].of(Estop)
    world.raise_estop(stop, doors=("manager", "agents"))
    run(world, 0.3)
    assert stop in heard[LEFT].of(Estop)
    assert mode(world) is Mode.ESTOP


# Computers


def test_the_clocks_of_hosts_differ_in_offset_and_rate(bundle: CellBundle) -> None:
    world = World(bundle, 1, CALM)
    before = {name: host.now for name, host in world.hosts.items()}
    assert len({round(now) for now in before.values()}) == len(before)
    run(world, 2.0)
    rates = {name: (host.now - before[name]) / 2.0 for name, host in world.hosts.items()}
    assert len(set(rates.values())) == len(rates)
    assert all(rate == pytest.approx(1.0, abs=1e-4) for rate in rates.values())


def test_the_wall_clock_of_a_host_may_be_set_and_the_monotonic_one_not() -> None:
    clock = Clock()
    host = Host(clock, 5.0, 100.0, 2_000.0)
    monotonic, unix = host.now, host.unix()
    host.step(-500.0)
    clock.run_until(clock.now + 10.0)
    assert host.now - monotonic == pytest.approx(10.001)
    assert host.unix() - unix == pytest.approx(10.001 - 500.0)
    host.drift = 0.0
    now = host.now
    clock.run_until(clock.now + 10.0)
    assert host.now - now == pytest.approx(10.0)


def test_a_plan_takes_its_time_and_comes_in_the_order_of_the_requests(bundle: CellBundle) -> None:
    world = World(bundle, 1, CALM)
    planner, planned = world.planners["left"], []
    home = planner.model.home
    near, far = (JointStep(1, (angle, *home[1:]), 1.0) for angle in (0.1, 1.5))
    worker = SimWorker(planner, world.clock, 0.5, planned.append)
    worker.submit(PlanRequest(1, (far,), home, ()))
    worker.submit(PlanRequest(2, (near,), home, ()))
    first, second = (each.motion.duration_s for each in planned)
    assert first > second
    run(world, 0.03 + 0.5 * first - 1e-6)
    assert worker.results() == []
    run(world, 2e-6)
    assert [result.id for result in worker.results()] == [1]
    run(world, 0.03 + 0.5 * second)
    assert [result.id for result in worker.results()] == [2]


def test_an_agent_plans_with_the_quick_stop_of_its_drives_file(bundle: CellBundle) -> None:
    planner = calm(bundle).planners["left"]
    axes = bundle.gateways["left_bus"].robots["left"].axes
    assert planner.quick_stop == tuple(axis.quick_stop for axis in axes)
    assert planner.quick_stop == pytest.approx(np.radians([600, 550, 650, 1100, 1100, 1300]))


# The journal


def epoch(world: World) -> int:
    assert world.seen.manager is not None
    return world.seen.manager.epoch


def restarted(world: World) -> ManagerState:
    world.kill("manager")
    world.seen.manager = None
    world.start("manager")
    until(world, lambda: world.seen.manager is not None)
    assert world.seen.manager is not None
    return world.seen.manager


def stopped(world: World) -> None:
    world.operate("manager", SetEstop("e1", "operator", "test"))
    until(world, lambda: world.seen.manager is not None and bool(world.seen.manager.estops))


def test_the_journal_keeps_the_emergency_stop_over_a_restart(bundle: CellBundle) -> None:
    world = calm(bundle)
    stopped(world)
    before = epoch(world)
    state = restarted(world)
    assert state.estops
    assert state.epoch > before


def test_an_end_of_a_stop_that_anybody_publishes_ends_nothing_and_a_reset_does(bundle: CellBundle) -> None:
    world = calm(bundle)
    stopped(world)
    run(world, 0.5)
    for _ in range(10):
        world.publish(Estop("e1", False, "stranger", ""), "stranger")
        run(world, 0.05)
    assert {state.mode for state in world.seen.robots.values()} == {Mode.ESTOP}
    assert {state.estop for state in world.seen.gateways.values()} == {"e1"}
    world.operate("manager", ResetEstop("operator", ("e1",)))
    until(world, lambda: {state.mode for state in world.seen.robots.values()} == {Mode.DISABLED})
    until(world, lambda: {state.estop for state in world.seen.gateways.values()} == {None})


def test_a_lost_journal_forgets_and_the_epoch_still_grows(bundle: CellBundle) -> None:
    world = calm(bundle)
    before = epoch(world)
    world.journal.lose()
    run(world, 1.1)
    assert restarted(world).epoch > before


def test_an_old_journal_lacks_the_newest_writes(bundle: CellBundle) -> None:
    world = World(bundle, 1, CALM)
    until(world, lambda: world.seen.manager is not None)
    stopped(world)
    world.kill(LEFT)
    world.kill("robot/right")
    for gateway in world.cell.gateways:
        world.kill(f"gateway/{gateway}")
    world.journal.roll_back(1)
    assert not restarted(world).estops


def test_a_full_disk_neither_stops_a_stop_nor_ends_the_manager(bundle: CellBundle) -> None:
    world = calm(bundle)
    world.journal.fill(True)
    stopped(world)
    until(world, lambda: "journal_failed" in [event.code for event in world.seen.events])
    assert world.processes["manager"].alive
    world.journal.fill(False)
    until(world, lambda: "journal_written" in [event.code for event in world.seen.events])
    assert restarted(world).estops


def test_a_full_disk_keeps_a_manager_from_starting(bundle: CellBundle) -> None:
    world = calm(bundle)
    world.journal.fill(True)
    world.kill("manager")
    world.start("manager")
    assert not world.processes["manager"].alive
    assert "full" in world.seen.said[-1][1]
    world.journal.fill(False)
    world.start("manager")
    assert world.processes["manager"].alive


def test_without_weather_blocks_and_states_arrive(bundle: CellBundle) -> None:
    world = moving(bundle)
    run(world, 0.5)
    assert isinstance(world.operator("operator").robots["left"], RobotState)
    counters = world.seen.gateways["left_bus"].counters
    assert counters.blocks_accepted > 10
    assert counters.blocks_refused == 0
