"""Each invariant sees what it is for: a good run is kept, changed in one place, and judged again."""

from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cell.core import Request
from cell.messages import (
    COMMANDS,
    AcceptPosition,
    AdoptZone,
    Assurance,
    AxisStatus,
    Call,
    Clearance,
    ClearSetup,
    ClearZone,
    Command,
    Confinement,
    Continue,
    DisableDrives,
    DriveFeedback,
    EnableDrives,
    EndAssurance,
    Estop,
    Event,
    ForceOutput,
    GatewayState,
    Halt,
    Heard,
    Home,
    JogHeld,
    Load,
    ManagerState,
    Mode,
    PlayoutState,
    Presence,
    Reply,
    ResetDrives,
    ResetEstop,
    RobotStands,
    RobotState,
    Run,
    SetEstop,
    SetpointBlock,
    Severity,
    Stop,
    SwitchOutput,
    Token,
    Way,
    ZoneState,
)
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.gateway.effects import Frame
from robot_agent.agent.planning.plans import Plan
from tests.sim.apart_cell import apart_cell
from tests.sim.clock import Clock
from tests.sim.coverage import ELSEWHERE, event_codes
from tests.sim.faults import DriveFails, JogPress, Kill, Moment
from tests.sim.faults import Stop as EmergencyStop
from tests.sim.judge import ALL
from tests.sim.judge.facts import STRANGER
from tests.sim.recording import Change, Recording, after, each, with_one_more
from tests.sim.recording import Moment as Seen
from tests.sim.world import load_bundle
from tests.unit.config_world import Copy

ONE, OTHER, ZONE = "placer", "stacker", "table"
LEFT, RIGHT = "left", "right"
PROGRAMS = {
    ONE: """LABEL again
MJ J1=-70 J2=140 J3=20 J4=-70 F=60
ML X=470 Y=0 C=0 A=0 B=0 F=600
WAIT 0.2
ML X=190 F=800
GOTO again 9
""",
    OTHER: """LABEL again
ML X=1150 Y=0 Z=1400 F=1500
ML X=1600 F=1500
WAIT 0.3
ML X=1150 F=1500
GOTO again 9
""",
}
PLAN = (
    Kill(2.5, Moment(ONE, "is inside", 0.2), "manager", 0.4),
    EmergencyStop(4.5, Moment(OTHER, "moves fast"), "anna", ("manager", "gateways", "agents")),
    JogPress(6.5, None, "bert", ONE, "J1", 0.1, 2.0, True),
    DriveFails(9.5, Moment(OTHER, "moves fast"), OTHER, 0, "emergency", 0.0),
)
SECONDS = 12.0


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    copy = Copy(tmp_path_factory.mktemp("judge"))
    for robot, text in PROGRAMS.items():
        (copy.folder / "mixed" / "programs" / f"{robot}.prog").write_text(text)
        copy.change(f"mixed/{robot}_drives.yaml", "cycle_s: 0.004", "cycle_s: 0.02")
    copy.change("mixed/cell.yaml", "owner_silent_s: 2}", "owner_silent_s: 2, lead_s: 0.06}")
    copy.change("mixed/cell.yaml", "on_manager_return: continue", "on_manager_return: operator")
    copy.add("mixed/cell.yaml", "separation: off")  # the faults of the plan fit robots that wait for zones alone
    return Recording(load_bundle(copy.folder / "mixed" / "cell.yaml"), SECONDS, PLAN)


TOWARDS_EACH_OTHER = """MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0 F=100
ML X=2000 Y=0 Z=1250 A=0 B=90 C=0 F=1500
WAIT 5
"""


@pytest.fixture(scope="module")
def kept_apart(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """Without a zone: who is there first stays, and the other one stops in front of it."""
    programs = dict.fromkeys((LEFT, RIGHT), TOWARDS_EACH_OTHER)
    return Recording(load_bundle(apart_cell(tmp_path_factory.mktemp("apart"), programs)), 7.0, ())


def first(run: Recording, kind: str, of: type, good: Callable[[Any], bool], since: float = 0.0) -> Seen:
    """The first message of a type that is as it should be."""
    return next(m for m in run.moments if m.kind == kind and isinstance(m.what, of) and m.at >= since and good(m.what))


def inside_at(run: Recording, robot: str) -> Seen:
    """A sample in which a robot is really inside the zone."""
    facts = run.judge.facts
    return next(
        m
        for m in run.moments
        if m.kind == "sample" and facts.touching(robot, m.what[robot][None])[ZONE][0] and held(run, robot).at < m.at
    )


def held(run: Recording, robot: str) -> Seen:
    """The first state of the manager that says that a robot is inside."""
    return first(run, "published", ManagerState, lambda s: in_zone(s, robot))


def in_zone(state: ManagerState, robot: str) -> bool:
    return state.zones[ZONE].holder == robot and state.zones[ZONE].state is ZoneState.OCCUPIED


def moving_at(run: Recording, robot: str = ONE) -> float:
    """A moment in the middle of a motion of the program, long before the first fault."""
    return first(
        run,
        "published",
        RobotState,
        lambda s: s.robot == robot and s.mode is Mode.RUNNING and (s.tcp_speed_m_s or 0) > 0.2,
    ).at


def zone_is(told: ManagerState, **fields: Any) -> ManagerState:
    return replace(told, zones={**told.zones, ZONE: replace(told.zones[ZONE], **fields)})


def of(robot: str, change: Callable[[Any], Any]) -> Callable[[Seen], Any]:
    return lambda m: change(m.what) if m.what.robot == robot else m.what


def samples(robot: str, axes: Callable[[Any], Any]) -> Change:
    def changed(moments: list[Seen]) -> Iterator[Seen]:
        for m in moments:
            yield replace(m, what={**m.what, robot: axes(m.what[robot])}) if m.kind == "sample" else m

    return changed


def without_calls(*commands: type) -> Change:
    return each("delivered", Request, lambda m: None if isinstance(m.what.call.command, commands) else m.what)


def both_in_it(run: Recording) -> Change:
    place = inside_at(run, OTHER).what[OTHER]
    return after(inside_at(run, ONE).at, samples(OTHER, lambda _: place))


def somewhere_else(run: Recording) -> Change:
    return after(moving_at(run), samples(ONE, lambda axes: axes + 0.3))


def zone_called_free(run: Recording) -> Change:
    free = each("published", ManagerState, lambda m: zone_is(m.what, state=ZoneState.FREE, holder=None, token=None))
    return after(held(run, ONE).at + 0.1, free)


def body_too_short(run: Recording) -> Change:
    def short(presence: Presence) -> Presence:
        body = presence.body
        first = replace(body, poses=body.poses[:1], growth_m=body.growth_m[:1], tcp_m=body.tcp_m[:1])
        return replace(presence, body=first)

    return after(moving_at(run), each("published", Presence, of(ONE, short)))


def says_it_stands(run: Recording) -> Change:
    stands = each("published", Presence, of(ONE, lambda p: replace(p, stop_time_s=0.0)))
    return after(moving_at(run), stands)


def breach(run: Recording) -> Change:
    told = Event("manager", 999, Severity.ALARM, "zone_breach", f"{ONE} is in zone {ZONE} without a grant")
    return with_one_more(moving_at(run), "published", "manager", told)


def not_granted(_: Recording) -> Change:
    return each("delivered", ManagerState, lambda m: zone_is(m.what, holder=OTHER), f"robot/{ONE}")


def holds_without_a_grant(_: Recording) -> Change:
    return each("published", Presence, of(ONE, lambda p: replace(p, holds={ZONE: Token(1, 1)})))


def adopted_beside_another(run: Recording) -> Change:
    inside = held(run, ONE).at + 0.1
    order = Request("9", Call("9", AdoptZone(ZONE, OTHER, "anna"), None))
    asked = with_one_more(inside, "delivered", "manager", order)
    answered = with_one_more(inside + 0.01, "published", "manager", Reply("9", True, ""))
    return lambda moments: answered(list(asked(moments)))


def mended_unbroken(run: Recording) -> Change:
    told = Event("manager", 999, Severity.INFO, "journal_written", "the journal is written again", boot="m")
    return with_one_more(moving_at(run), "published", "manager", told)


def confirmed_while_on(run: Recording) -> Change:
    confirmed = each("published", GatewayState, lambda m: replace(m.what, estop_confirmed="loud"))
    return after(moving_at(run), confirmed)


def late_and_driven_on(run: Recording) -> Change:
    gateway = run.judge.facts.gateway_of(ONE)
    boot = next(m.what.boot for m in run.moments if m.kind == "published" and m.name == gateway)
    frozen = with_one_more(moving_at(run), "life", gateway, ("frozen", boot))
    thawed = with_one_more(moving_at(run) + 1.0, "life", gateway, ("thawed", boot))
    return lambda moments: thawed(list(frozen(moments)))


def stopped_and_moving(run: Recording) -> Change:
    """For a moment of its motion the gateway says that it stops the robot, and then that it has stopped."""
    at = moving_at(run)

    def said(feedback: DriveFeedback, now: float) -> DriveFeedback:
        state = PlayoutState.STOPPING if now < at + 0.04 else PlayoutState.FAULT
        return replace(feedback, enabled=False, state=state)

    stopped = each("published", DriveFeedback, lambda m: said(m.what, m.at) if m.what.robot == ONE else m.what)
    return after(at, stopped)


def let_go_inside(run: Recording) -> Change:
    without = each("published", Presence, of(ONE, lambda p: replace(p, holds={})))
    return after(held(run, ONE).at + 0.1, without)


def taken_again(run: Recording) -> Change:
    gave_up = next(
        (before, later)
        for before, later in zip(presences(run, ONE), presences(run, ONE)[1:], strict=False)
        if before.what.holds and not later.what.holds
    )
    token = gave_up[0].what.holds[ZONE]
    again = each("published", Presence, of(ONE, lambda p: replace(p, holds={ZONE: token})))
    return after(gave_up[1].at + 0.001, again)


def presences(run: Recording, robot: str) -> list[Seen]:
    return [m for m in run.moments if m.kind == "published" and isinstance(m.what, Presence) and m.what.robot == robot]


def granted_at_once(_: Recording) -> Change:
    return each(
        "published",
        ManagerState,
        lambda m: zone_is(m.what, state=ZoneState.GRANTED, holder=ONE, token=Token(m.what.epoch, 999)),
    )


def pushes_in(run: Recording) -> Change:
    """Who waits alone is second all of a sudden."""
    waits = first(run, "published", ManagerState, lambda state: len(state.zones[ZONE].queue) == 1)
    (early,) = waits.what.zones[ZONE].queue
    late = OTHER if early == ONE else ONE
    wants = each("delivered", Presence, of(late, lambda presence: replace(presence, wants={ZONE: 0.0})), "manager")
    line = each("published", ManagerState, lambda m: zone_is(m.what, queue=(late, early)))

    def both(moments: list[Seen]) -> Iterator[Seen]:
        return after(waits.at + 1e-3, line)(list(wants(moments)))

    return both


def forgotten_by_the_next(run: Recording) -> Change:
    second = first(run, "life", tuple, lambda what: what[0] == "started", 1002.0).at
    free = each("published", ManagerState, lambda m: zone_is(m.what, state=ZoneState.FREE, holder=None, token=None))
    return after(second, free)


def called_granted(run: Recording) -> Change:
    granted = each("published", ManagerState, lambda m: zone_is(m.what, state=ZoneState.GRANTED))
    return after(held(run, ONE).at + 0.05, granted)


def smaller_token(run: Recording) -> Change:
    small = each("published", ManagerState, lambda m: zone_is(m.what, token=Token(1, 1)))
    return after(held(run, ONE).at, small)


def number_left_out(run: Recording) -> Change:
    at = moving_at(run)
    return each("published", Presence, lambda m: None if m.at == at and m.what.robot == ONE else m.what)


def older_echo(run: Recording) -> Change:
    def older(presence: Presence) -> Presence:
        heard = presence.heard
        return replace(presence, heard=None if heard is None else Heard(heard.boot, heard.sequence - 20))

    at = moving_at(run)
    return each("published", Presence, lambda m: older(m.what) if m.at == at and m.what.robot == ONE else m.what)


def jump(run: Recording) -> Change:
    """For a moment of its motion the drives are commanded something else."""
    at = moving_at(run)
    aside = each("published", DriveFeedback, of(ONE, lambda f: replace(f, commanded=f.commanded + 0.02)))

    def changed(moments: list[Seen]) -> Iterator[Seen]:
        yield from (m for m in moments if m.at < at)
        yield from aside([m for m in moments if at <= m.at < at + 0.2])
        yield from (m for m in moments if m.at >= at + 0.2)

    return changed


def frames_one_late(_: Recording) -> Change:
    """Each frame carries what the one before it should have."""
    before: dict[int, CanFrame] = {}

    def late(m: Seen) -> Frame:
        frame: CanFrame = m.what.frame
        instead = before.get(frame.id, frame)
        before[frame.id] = frame
        return Frame(instead)

    return each("effect", Frame, late)


def manager_not_heard(run: Recording) -> Change:
    return after(moving_at(run), each("delivered", ManagerState, lambda _: None, f"robot/{ONE}"))


def stop_not_heeded(run: Recording) -> Change:
    return with_one_more(moving_at(run), "delivered", f"robot/{ONE}", Estop("loud", True, "anna", "test"))


def stop_not_heeded_by_gateway(run: Recording) -> Change:
    gateway = run.judge.facts.gateway_of(ONE)
    return with_one_more(moving_at(run), "delivered", gateway, Estop("loud", True, "anna", "test"))


def nobody_asked(_: Recording) -> Change:
    return without_calls(Run, Continue)


def off_and_moving(run: Recording) -> Change:
    off = each("published", DriveFeedback, of(ONE, lambda f: replace(f, enabled=False, state=PlayoutState.FOLLOWING)))
    return after(moving_at(run), off)


def no_more_blocks(run: Recording) -> Change:
    return after(moving_at(run), each("published", SetpointBlock, of(ONE, lambda _: None)))


def block_without_end(_: Recording) -> Change:
    return each("published", SetpointBlock, lambda m: replace(m.what, velocity=m.what.velocity + 0.1))


def all_refused(_: Recording) -> Change:
    return each("published", DriveFeedback, of(ONE, lambda f: replace(f, refused=f.tick)))


def halted_and_moving(run: Recording) -> Change:
    halted = each("published", RobotState, of(ONE, lambda s: replace(s, mode=Mode.HALTED)))
    return after(moving_at(run), halted)


def silent_about_it(run: Recording) -> Change:
    place = inside_at(run, ONE).what[ONE]
    silent = each("published", RobotState, of(ONE, lambda s: replace(s, waiting_for="")))

    def changed(moments: list[Seen]) -> Iterator[Seen]:
        yield from silent(list(samples(ONE, lambda _: place)(moments)))

    return changed


def drives_not_heard(run: Recording) -> Change:
    return after(moving_at(run), each("delivered", DriveFeedback, lambda _: None, f"robot/{ONE}"))


def silent_drive(run: Recording) -> Change:
    silent = each("published", DriveFeedback, of(ONE, lambda f: replace(f, axes=(AxisStatus.SILENT, *f.axes[1:]))))
    return after(moving_at(run), silent)


def no_key(_: Recording) -> Change:
    return each("delivered", JogHeld, lambda _: None)


def kept_waiting(run: Recording) -> Change:
    waits = each(
        "published",
        ManagerState,
        lambda m: zone_is(m.what, state=ZoneState.FREE, holder=None, token=None, queue=(ONE,), reason=""),
    )
    return after(moving_at(run), waits)


def holder_not_heard(run: Recording) -> Change:
    deaf = each("delivered", Presence, of(ONE, lambda _: None), "manager")
    return after(held(run, ONE).at, deaf)


def old_order(_: Recording) -> Change:
    """As if its caller had seen the robot's first state."""

    def old(request: Request) -> Request:
        call = request.call
        assert isinstance(call, Call)
        if not isinstance(call.command, Run) or call.heard is None:
            return request
        return replace(request, call=replace(call, heard=Heard(call.heard.boot, 1)))

    return each("delivered", Request, lambda m: old(m.what))


def stop_forgotten(_: Recording) -> Change:
    return each("published", ManagerState, lambda m: replace(m.what, estops=()))


def owner_of_before(run: Recording) -> Change:
    return after(moving_at(run), each("published", DriveFeedback, of(ONE, lambda f: replace(f, owner=f.owner - 1))))


def output_by_itself(_: Recording) -> Change:
    return each("published", DriveFeedback, lambda m: replace(m.what, outputs=0 if m.what.enabled else 1))


def planned_again_and_again(run: Recording) -> Change:
    plan = next(m for m in run.moments if m.kind == "effect" and isinstance(m.what, Plan))

    def changed(moments: list[Seen]) -> Iterator[Seen]:
        yield from (m for m in moments if m.at <= plan.at)
        yield from [plan] * 50

    return changed


def comes_nearer(run: Recording) -> Change:
    """As if it had gone on to where the other one stands."""
    leans = np.array([0.0, 0.0, -0.3, 0.0, 0.0, 0.0])
    return after(waiting_at(run), samples(LEFT, lambda axes: axes + leans))


def waiting_at(run: Recording) -> float:
    return first(run, "published", RobotState, lambda s: s.robot == LEFT and RIGHT in s.waiting_for).at


def commits_to_nothing(run: Recording) -> Change:
    """Its presences commit it to nothing but where it is."""
    little = each("published", Presence, of(LEFT, lambda p: replace(p, way=replace(p.way, committed=1))))
    return after(moving_at(run, LEFT), little)


def space_given_away(run: Recording) -> Change:
    """From a moment of its motion on the manager keeps no more than what was kept then."""
    at = moving_at(run, LEFT)
    kept = next(m for m in run.moments if m.kind == "space" and m.at >= at).what[LEFT][1]

    def changed(moments: list[Seen]) -> Iterator[Seen]:
        for m in moments:
            yield replace(m, what={**m.what, LEFT: (m.what[LEFT][0], kept)}) if m.kind == "space" else m

    return after(at, changed)


def nothing_cleared(_: Recording) -> Change:
    return each("published", Clearance, lambda m: replace(m.what, cleared=0))


def owned_too_near(run: Recording) -> Change:
    """The sections of one robot reach to the other one."""

    def grown(way: Way) -> Way:
        return replace(way, sections=replace(way.sections, radii=way.sections.radii + np.float32(3.0)))

    return after(moving_at(run, LEFT), each("published", Presence, of(RIGHT, lambda p: replace(p, way=grown(p.way)))))


def boxed_where_others_go(run: Recording) -> Change:
    """The manager calls the other one confined to a box in the way of this one, and clears that."""
    word = Assurance("anna", Confinement((3.0, 3.0, 3.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0)))
    said = each("published", ManagerState, lambda m: replace(m.what, assured={RIGHT: word}))
    return after(moving_at(run, LEFT), said)


def says_not_for_whom(_: Recording) -> Change:
    return each("published", RobotState, of(LEFT, lambda s: replace(s, waiting_for="cleared space")))


PLANTED: dict[str, Callable[[Recording], Change]] = {
    "one body in a zone": both_in_it,
    "the real body is published": somewhere_else,
    "who is inside is holder or suspect": zone_called_free,
    "who brakes keeps its zones": zone_called_free,
    "a block stays within the published body": body_too_short,
    "the stop time is true": says_it_stands,
    "no breach": breach,
    "enters by a fresh grant": not_granted,
    "no block leads into a zone without a grant": not_granted,
    "an agent holds only what it is granted": holds_without_a_grant,
    "an agent holds a zone while it is inside": let_go_inside,
    "a token given up is never taken again": taken_again,
    "a breach is a stop": breach,
    "grants are due": granted_at_once,
    "first come, first served": pushes_in,
    "who adopts a zone is alone in it": adopted_beside_another,
    "a grant ends by its holder": zone_called_free,
    "grants outlive a manager": forgotten_by_the_next,
    "occupied is what is the case": called_granted,
    "tokens grow": smaller_token,
    "sequences grow": number_left_out,
    "echoes grow": older_echo,
    "a journal that is mended was broken": mended_unbroken,
    "joints keep their limits": jump,
    "drives get what is said": frames_one_late,
    "on this motion": jump,
    "plays what was sent": jump,
    "stops without a manager": manager_not_heard,
    "stops under an emergency stop": stop_not_heeded,
    "a gateway obeys an emergency stop": stop_not_heeded_by_gateway,
    "a confirmed emergency stop has stopped": confirmed_while_on,
    "a cycle that is far too late stops": late_and_driven_on,
    "nothing moves by itself": nobody_asked,
    "stands once it is stopped": off_and_moving,
    "a stop ends at rest": stopped_and_moving,
    "blocks keep coming": no_more_blocks,
    "a block ends at rest": block_without_end,
    "blocks are taken": all_refused,
    "modes have causes": nobody_asked,
    "halted where an operator decides": manager_not_heard,
    "the mode is what is the case": halted_and_moving,
    "a halt ends at rest": halted_and_moving,
    "says why it stands": silent_about_it,
    "nothing new without feedback": drives_not_heard,
    "no drive is left alone": silent_drive,
    "jogs while the key is held": no_key,
    "a free zone is granted": kept_waiting,
    "a silent holder's zone is blocked": holder_not_heard,
    "orders are carried out in time and once": old_order,
    "emergency stops are kept": stop_forgotten,
    "one owner": owner_of_before,
    "outputs are switched by order": output_by_itself,
    "effort is bounded": planned_again_and_again,
}
PLANTED_KEPT_APART: dict[str, Callable[[Recording], Change]] = {
    "robots are kept apart": comes_nearer,
    "the real body is in owned space": comes_nearer,
    "blocks keep to owned space": commits_to_nothing,
    "what is queued is reserved": space_given_away,
    "owned space was cleared": nothing_cleared,
    "owned space is kept apart": owned_too_near,
    "nobody is cleared into a box": boxed_where_others_go,
    "says for whom it waits": says_not_for_whom,
}


@pytest.mark.parametrize("code", ELSEWHERE)
def test_what_no_generated_cell_does_is_seen_by_a_test_of_its_own(code: str) -> None:
    assert code in event_codes(), "nobody tells it any more"
    assert f'"{code}"' in (Path(__file__).parents[1] / ELSEWHERE[code]).read_text()


def test_every_invariant_has_a_fault_that_it_must_see() -> None:
    assert sorted([*PLANTED, *PLANTED_KEPT_APART]) == sorted(kind.name for kind in ALL)


def test_a_good_run_breaks_nothing_when_it_is_judged_again(run: Recording, kept_apart: Recording) -> None:
    assert run.judged(lambda moments: moments) is None
    assert kept_apart.judged(lambda moments: moments) is None


@pytest.mark.parametrize(
    ("to", "age_s", "good"), [("gateway", 0.65, True), ("gateway", 0.75, False), ("robot", 0.65, False)]
)
def test_an_order_to_a_gateway_may_be_older_by_what_lies_between_two_of_its_states(
    run: Recording, to: str, age_s: float, good: bool
) -> None:
    at = moving_at(run)
    name = f"robot/{ONE}" if to == "robot" else run.judge.facts.gateway_of(ONE)
    kind: type = RobotState if to == "robot" else GatewayState
    seen = next(m for m in run.moments if m.name == name and isinstance(m.what, kind) and m.at >= at)
    order = Run() if to == "robot" else SwitchOutput(ONE, "gripper", False, "anna")
    call = Call("9", order, Heard(seen.what.boot, seen.what.sequence))
    asked = with_one_more(seen.at + age_s, "delivered", name, Request("9", call))
    answered = with_one_more(seen.at + age_s + 0.01, "published", name, Reply("9", True, ""))
    broken = run.judged(lambda moments: answered(list(asked(moments))), "orders are carried out in time and once")
    assert (broken is None) == good


@pytest.mark.parametrize(("age_s", "good"), [(0.45, True), (0.55, False)])
@pytest.mark.parametrize("command", [EnableDrives(ONE, 1), ResetDrives(ONE, 1)], ids=lambda command: command.verb)
def test_an_agents_order_to_its_gateway_counts_from_the_feedback_that_it_answers(
    run: Recording, command: Command, age_s: float, good: bool
) -> None:
    seen = first(run, "published", DriveFeedback, lambda f: f.robot == ONE, moving_at(run))
    heard = Heard(seen.what.boot, seen.what.sequence)
    change = carried_out(run.judge.facts.gateway_of(ONE), command, heard, seen.at + age_s)
    assert (run.judged(change, "orders are carried out in time and once") is None) == good


@pytest.mark.parametrize(
    "command",
    [
        ResetEstop("anna", ()), RobotStands(ONE, "anna"), ClearSetup(ONE, "anna"), ClearZone(ZONE, "anna"),
        AdoptZone(ZONE, ONE, "anna"), ForceOutput(ONE, "gripper", None, "anna"), AcceptPosition(ONE, ()), Home(ONE, ()),
        Load(""), Halt(), Stop(), SetEstop("loud", "anna", ""), EndAssurance(ONE, "anna"), DisableDrives(ONE, 1),
    ],
    ids=lambda command: command.verb,
)  # fmt: skip
def test_what_moves_or_releases_something_is_dated_and_what_stops_is_not(run: Recording, command: Command) -> None:
    names = {"manager": "manager", "gateway": run.judge.facts.gateway_of(ONE), "robot": f"robot/{ONE}"}
    name = next(name for role, name in names.items() if command.verb in COMMANDS[role])
    broken = run.judged(carried_out(name, command, None, moving_at(run)), "orders are carried out in time and once")
    assert (broken is None) == isinstance(command, Halt | Stop | SetEstop | EndAssurance | DisableDrives)


def carried_out(name: str, command: Command, heard: Heard | None, at: float) -> Change:
    """One more order, that its addressee says to have carried out."""
    asked = with_one_more(at, "delivered", name, Request("9", Call("9", command, heard)))
    answered = with_one_more(at + 0.01, "published", name, Reply("9", True, ""))
    return lambda moments: answered(list(asked(moments)))


@pytest.mark.parametrize("by_manager", [True, False])
def test_a_stop_ends_for_the_judge_by_the_managers_word_alone(run: Recording, by_manager: bool) -> None:
    at, name = moving_at(run), f"robot/{ONE}"
    stop = Estop("loud", True, "anna", "test")
    over = replace(stop, active=False)
    told = with_one_more(at + 0.001, "delivered", name, stop)
    ended = with_one_more(at + 0.001, "published", "manager" if by_manager else STRANGER, over)
    heard = with_one_more(at + 0.001, "delivered", name, over)
    # One more is put in front of what is there: the last of these is the first.
    broken = run.judged(lambda moments: told(list(ended(list(heard(moments))))), "stops under an emergency stop")
    assert (broken is None) == by_manager


@pytest.mark.parametrize(("reason", "good"), [(f"{OTHER} fell silent", True), (f"{ONE} fell silent", False)])
def test_a_blocked_zone_accounts_for_those_whom_its_reason_names(run: Recording, reason: str, good: bool) -> None:
    blocked = each(
        "published",
        ManagerState,
        lambda m: zone_is(m.what, state=ZoneState.ORPHANED, holder=None, token=None, reason=reason),
    )

    def changed(moments: list[Seen]) -> Iterator[Seen]:
        """Of a robot that has been granted the zone by this manager."""
        at = inside_at(run, OTHER).at
        yield from (m for m in moments if m.at < at)
        yield from blocked([m for m in moments if at <= m.at < at + 0.1])

    assert (run.judged(changed, "who is inside is holder or suspect") is None) == good


@pytest.mark.parametrize("moves", [True, False])
def test_an_axis_may_be_behind_its_command_by_what_it_goes_on_until_its_position_shows_it(
    run: Recording, moves: bool
) -> None:
    facts = run.judge.facts
    gateway = facts.world.bundle.gateways[facts.cell.robots[ONE].gateway]
    axes = gateway.robots[ONE].axes
    away = 2.0 * np.array([axis.following_window for axis in axes])
    speed = away / [gateway.cycle_s * axis.delay_cycles for axis in axes] if moves else 0.0 * away
    behind = each(
        "published",
        DriveFeedback,
        of(ONE, lambda f: replace(f, commanded=f.position + away, velocity=speed, enabled=True)),
    )
    broken = run.judged(after(moving_at(run), behind), "no drive is left alone")
    assert (broken is None) == moves


@pytest.mark.parametrize("told_before", [True, False])
def test_a_breach_that_was_told_while_drives_were_off_is_told_again_by_a_manager_that_starts_anew(
    run: Recording, told_before: bool
) -> None:
    at = held(run, ONE).at + 0.1
    told = Event("manager", 999, Severity.ALARM, "zone_breach", f"{ONE} is in zone {ZONE} without a grant")
    off = each("published", DriveFeedback, lambda m: replace(m.what, enabled=not at < m.at < at + 0.1))
    again = with_one_more(at + 0.2, "published", "manager", replace(told, boot="anew"))
    before = with_one_more(at + 0.05, "published", "manager", told) if told_before else list
    broken = run.judged(lambda moments: again(list(before(list(off(moments))))), "no breach")
    assert (broken is None) == told_before


@pytest.mark.parametrize(("heard", "since_s"), [(True, 2.0), (False, 0.0)])
def test_a_drive_that_drops_out_while_its_bus_has_failed_has_been_silent_since_then(
    run: Recording, heard: bool, since_s: float
) -> None:
    facts = copy(run.judge.facts)
    facts.world, facts.silenced = SimpleNamespace(clock=SimpleNamespace(now=0.0)), {}
    facts.silence(ONE, 3.0)
    facts.world.clock.now = 2.0
    facts.silence(ONE, 0.5, heard=heard)
    assert facts.silenced[ONE] == (since_s, 3.0)


def test_a_drive_that_two_faults_keep_off_the_bus_is_back_when_both_are_over(run: Recording) -> None:
    facts, clock = copy(run.judge.facts), Clock()
    facts.world, facts.silenced = SimpleNamespace(clock=clock), {}
    began, back = clock.now, []
    node = SimpleNamespace(silence=lambda _: back.append(clock.now - began))
    for seconds in (1.2, 0.3):
        facts.silence(ONE, seconds)
        fault = DriveFails(0.0, None, ONE, 0, "drop-out", seconds)
        clock.after(seconds, fault._back, SimpleNamespace(world=facts.world, facts=facts), node)
    clock.run_until(began + 2.0)
    assert back == pytest.approx([1.2, 1.2])


@pytest.mark.parametrize("name", PLANTED)
def test_an_invariant_sees_its_fault(run: Recording, name: str) -> None:
    broken = run.judged(PLANTED[name](run), name)
    assert broken is not None
    assert broken.invariant == name


@pytest.mark.parametrize("name", PLANTED_KEPT_APART)
def test_an_invariant_of_cleared_space_sees_its_fault(kept_apart: Recording, name: str) -> None:
    broken = kept_apart.judged(PLANTED_KEPT_APART[name](kept_apart), name)
    assert broken is not None
    assert broken.invariant == name
