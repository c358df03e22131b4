"""Orders to a gateway that move, release or switch something are carried out soon after they were made, or never."""

from dataclasses import replace

import pytest

from cell.core import Frozen, Request
from cell.messages import (
    COMMANDS,
    AcceptPosition,
    AxisStatus,
    Call,
    Claim,
    Command,
    DisableDrives,
    EnableDrives,
    Fault,
    FaultDrive,
    ForceOutput,
    Heard,
    HoldSetup,
    Home,
    MoveAxes,
    PressAxis,
    ReadObject,
    RecordBus,
    Release,
    Reply,
    ResetDrives,
    ScanBus,
    SimulateInput,
    SwitchOutput,
    Who,
    WriteObject,
)
from drive_gateway.config.settings import HomingSettings
from drive_gateway.gateway.effects import RecordSaid
from tests.unit.gateway_world import KindManager, World, axis, gateway_settings

HOMING = HomingSettings(37, fast=0.4, slow=0.05, acceleration=5.0, position=0.0, order=1)
OF_STATE: dict[type[Command], Command] = {
    Home: Home("left", ()),
    MoveAxes: MoveAxes("left", {"J1": 0.1}, True, 1.0, False),
    PressAxis: PressAxis("left", "J1", 1.0, 1.0, 0.01),
    SwitchOutput: SwitchOutput("left", "gripper", True, "me"),
    ForceOutput: ForceOutput("left", "gripper", True, "me"),
    AcceptPosition: AcceptPosition("left", ()),
    WriteObject: WriteObject(1, 0x6081, 0, "00000000"),
    FaultDrive: FaultDrive(1, 1, Fault.BLOCKED),
    SimulateInput: SimulateInput("left", "part", True),
}
OF_FEEDBACK: dict[type[Command], Command] = {
    EnableDrives: EnableDrives("left", 100),
    ResetDrives: ResetDrives("left", 100),
}
AT_ANY_AGE: dict[type[Command], Command] = {
    Claim: Claim("left", "a1", "d"),
    Release: Release("left", 100),
    DisableDrives: DisableDrives("left", 100),
    ReadObject: ReadObject(1, 0x1018, 1),
    ScanBus: ScanBus(),
    RecordBus: RecordBus("x.asc", 1.0),
    HoldSetup: HoldSetup("left", "c1"),
    Who: Who(),
}


@pytest.fixture
def world() -> World:
    world = World(gateway_settings((axis("J1", 1, homing=HOMING), axis("J2", 2))))
    world.manager = KindManager()
    world.ready()
    world.until(lambda: world.feedback is not None)
    world.living = world.claim()
    world.drives[1].refuse[0x2020, 1] = 0x06020000
    world.run(0.3)
    return world


def answer(world: World, command: Command, heard: Heard | None) -> Reply:
    world.counted += 1
    name = f"r{world.counted}"
    world.tell(Request(name, Call(name, command, heard)))
    world.until(lambda: name in world.replies)
    return world.replies[name]


def seen(world: World, kind: type[Command]) -> Heard:
    message = world.feedback if kind in OF_FEEDBACK else world.state
    return Heard(message.boot, message.sequence)


def test_every_command_of_a_gateway_is_decided() -> None:
    assert set(OF_STATE) | set(OF_FEEDBACK) | set(AT_ANY_AGE) == set(COMMANDS["gateway"].values())


@pytest.mark.parametrize("kind", [*OF_STATE, *OF_FEEDBACK], ids=lambda kind: kind.__name__)
def test_what_moves_releases_or_switches_is_refused_when_its_caller_saw_nothing_young(
    world: World, kind: type[Command]
) -> None:
    order = {**OF_STATE, **OF_FEEDBACK}[kind]
    old = seen(world, kind)
    world.run(0.75)
    for heard in (old, None, replace(old, boot="another")):
        reply = answer(world, order, heard)
        assert not reply.ok
        assert "the call is too old to be carried out" in reply.text
    assert all(drive.statuses == [AxisStatus.SWITCH_ON_DISABLED] for drive in world.drives.values())
    assert "too old" not in answer(world, order, seen(world, kind)).text


@pytest.mark.parametrize("kind", AT_ANY_AGE, ids=lambda kind: kind.__name__)
def test_what_stops_switches_off_or_only_asks_is_never_refused_for_its_age(world: World, kind: type[Command]) -> None:
    if kind is RecordBus:
        world.tell(RecordSaid("r2", True, "the gateway writes x.asc for 1 s"))
    assert "too old" not in answer(world, AT_ANY_AGE[kind], None).text


def test_an_owners_order_is_as_young_as_the_feedback_that_it_echoes(world: World) -> None:
    owner = world.feedback.owner
    old = seen(world, EnableDrives)
    world.run(0.45)
    assert answer(world, EnableDrives("left", owner), old).ok


def test_a_gateway_that_was_frozen_believes_nothing_that_was_made_before(world: World) -> None:
    heard = seen(world, EnableDrives)
    world.tell(Frozen(0.3))
    assert "no longer known" in answer(world, EnableDrives("left", world.feedback.owner), heard).text


def test_a_call_that_fails_is_answered_and_the_gateway_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    world = World()
    world.ready()

    def fail(*_: object) -> None:
        raise OverflowError("math range error")

    monkeypatch.setattr(world.core._scan, "begin", fail)
    refused = world.ask(ScanBus())
    assert not refused.ok
    assert refused.text == "gateway left_bus could not carry out scan: OverflowError: math range error"
    assert "call_failed" in world.codes()
    assert world.ask(Who()).ok
