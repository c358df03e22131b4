"""Orders to fail: judged by the gateway, refused by whatever may be a real drive, and only then written."""

import pytest

from cell.messages import Fault, FaultDrive
from drive_gateway.canopen.fault_object import MARK
from tests.unit.gateway_world import World

VALUES = {Fault.EMERGENCY: 0x5112, Fault.ENCODER_JUMP: -4000, Fault.LATE_TPDOS: 60}
MARK_AT = (0x2020, 1)


def written(world: World) -> list[tuple[int, int, bytes]]:
    return [write for write in world.drives[1].writes if write[0] == 0x2020]


def simulated() -> World:
    world = World()
    world.drives[1].objects[MARK_AT] = MARK
    return world


@pytest.mark.parametrize("fault", Fault)
def test_drives_that_may_be_real_never_fail_on_command(fault: Fault) -> None:
    order = FaultDrive(1, 1, fault, VALUES.get(fault))
    world = World()
    world.drives[1].refuse[MARK_AT] = 0x06020000
    reply = world.ask(order)
    assert not reply.ok
    assert "node 1 (left J1) is no simulated drive of this project: 2020h: abort 06020000h" in reply.text
    assert "object does not exist; real drives never fail on command" in reply.text
    world.drives[1].refuse.clear()
    world.drives[1].objects[MARK_AT] = b"\x01\0\0\0"
    assert "no simulated drive of this project: 2020h:01 holds 01 00 00 00" in world.ask(order).text
    assert written(world) == []


@pytest.mark.parametrize(
    ("wrong", "found"),
    [
        (FaultDrive(9, 1, Fault.BLOCKED), "no axis 1 of node 9"),
        (FaultDrive(1, 1, Fault.EMERGENCY), "needs a value, the code of an error, 1 to 65535; found None"),
        (FaultDrive(1, 1, Fault.BLOCKED, 3), "takes no value; found 3"),
        (FaultDrive(1, 1, Fault.EMERGENCY, 0x5112, 1.0), "over when the drive is reset"),
        (FaultDrive(1, 1, Fault.DROP_OUT, None, -1.0), "above 0 and up to 3600 s; found -1"),
    ],
)
def test_an_order_that_cannot_be_says_why(wrong: FaultDrive, found: str) -> None:
    world = simulated()
    reply = world.ask(wrong)
    assert not reply.ok
    assert found in reply.text
    assert written(world) == []


def test_the_duration_is_written_before_the_fault() -> None:
    world = simulated()
    reply = world.ask(FaultDrive(1, 1, Fault.ENCODER_JUMP, -4000, 0.0001))
    assert reply.ok
    assert reply.text == "simulated drive 1, axis 1: encoder-jump -4000 for 0.0001 s"
    assert written(world) == [(0x2020, 2, b"\x01\0\0\0"), (0x2020, 5, b"\x60\xf0\xff\xff")]
    assert world.ask(FaultDrive(1, 1, Fault.EMERGENCY, 0x5112)).text.endswith("axis 1: emcy 5112h")
    assert written(world)[2:] == [(0x2020, 2, bytes(4)), (0x2020, 3, b"\x12\x51")]


@pytest.mark.parametrize("sub", [2, 6])
def test_a_write_that_fails_is_told_and_nothing_follows_it(sub: int) -> None:
    world = simulated()
    world.drives[1].refuse[0x2020, sub] = 0x06090030
    reply = world.ask(FaultDrive(1, 1, Fault.BLOCKED))
    assert not reply.ok
    assert reply.text == "node 1 (left J1) was not told to fail: abort 06090030h, value range of parameter exceeded"
    assert len(written(world)) == (0 if sub == 2 else 1)


def test_a_node_that_does_not_answer_is_not_taken_for_a_real_one() -> None:
    world = simulated()
    world.ready()
    world.drives[1].alive = False
    reply = world.ask(FaultDrive(1, 1, Fault.BLOCKED))
    assert not reply.ok
    assert reply.text == "node 1 (left J1) was not told to fail: no SDO response received"
