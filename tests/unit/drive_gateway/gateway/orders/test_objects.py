"""An operator's access to the nodes through their gateway: read always, write only when nothing can come of it."""

from collections.abc import Mapping

from cell.messages import ReadObject, RecordBus, ScanBus, WriteObject
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.gateway.effects import RecordEnded, RecordSaid
from drive_gateway.gateway.nodes.scan import Scan
from tests.unit.gateway_world import World


def test_an_object_is_read_while_the_robot_is_enabled() -> None:
    world = World()
    world.enabled()
    world.drives[1].objects[0x1008, 0] = b"drive"
    reply = world.ask(ReadObject(1, 0x1008, 0))
    assert reply.ok, reply.text
    assert bytes.fromhex(reply.data) == b"drive"


def test_a_refusal_of_the_node_is_told_by_its_name() -> None:
    world = World()
    world.ready()
    world.drives[1].refuse[0x2074, 0] = 0x06020000
    reply = world.ask(ReadObject(1, 0x2074, 0))
    assert not reply.ok
    assert reply.text == "2074h:00 of node 1 (left J1): abort 06020000h, object does not exist"


def test_a_node_that_is_not_on_the_bus_is_refused_with_those_that_are() -> None:
    assert world_reply(ReadObject(9, 0x6041, 0)).text == "no node 9 on this bus; its nodes are 1, 2"


def test_a_write_reaches_a_drive_that_is_off() -> None:
    world = World()
    world.ready()
    world.run(0.2)
    reply = world.ask(WriteObject(2, 0x6081, 0, "10270000"))
    assert reply.ok, reply.text
    assert world.drives[2].objects[0x6081, 0] == (10_000).to_bytes(4, "little")


def test_a_write_is_refused_while_the_drives_are_on() -> None:
    world = World()
    world.living = world.enabled()
    reply = world.ask(WriteObject(2, 0x6081, 0, "10270000"))
    assert not reply.ok
    assert "disable it first" in reply.text
    assert (0x6081, 0) not in world.drives[2].objects


def test_what_the_gateway_wrote_at_boot_and_the_controlword_stay_its_own() -> None:
    for index in (0x6085, 0x6007, 0x1A00):
        reply = world_reply(WriteObject(1, index, 0, "0000"))
        assert "is the gateway's; change it in the drives file" in reply.text
    for index in (0x6040, 0x607A, 0x60FF, 0x6071, 0x7071, 0x1005, 0x1014, 0x1200):
        assert world_reply(WriteObject(1, index, 0, "0000")).text.endswith("is the gateway's, nobody else writes it")


def test_data_that_are_no_hex_are_refused() -> None:
    assert world_reply(WriteObject(1, 0x6081, 0, "xy")).text == "'xy' are no bytes in hex"


def test_a_scan_asks_every_strange_node_and_names_all() -> None:
    world = World()
    world.ready()
    request = world.request(ScanBus())
    world.run(0.1)
    world.tell(CanFrame(0x580 + 9, bytes.fromhex("4300100092010200")))
    world.until(lambda: request in world.replies)
    assert world.replies[request].text.split("\n") == [
        "node 1 (left J1): Switch On Disabled",
        "node 2 (left J2): Switch On Disabled",
        "node 9: not in the drives file, device type 00020192h",
    ]
    asked = {frame.id - 0x600 for frame in world.frames if 0x600 < frame.id < 0x680 and frame.data[1:3] == b"\0\x10"}
    assert asked == set(range(3, 128)), "a new drive may have the gateway's own Node-ID"


def test_a_scan_with_long_cycles_asks_everybody_before_its_caller_gives_up() -> None:
    scan, found, cycle_s = Scan((1, 2)), list[Mapping[int, int]](), 0.04
    scan.begin(found.append)
    asked = [len(scan.step(number * cycle_s)) for number in range(round(1.5 / cycle_s))]
    assert sum(asked) == 125
    assert found == [{}]


def test_a_recording_is_answered_when_it_began_and_told_when_it_ended() -> None:
    world = World()
    request = world.request(RecordBus("x.asc", 1.0), call_id="c")
    world.cycle()
    world.tell(RecordSaid("c", True, "writing"), RecordEnded("x.asc holds 5 frames"))
    world.until(lambda: request in world.replies)
    assert world.replies[request].text == "writing"
    assert "recorded" in world.codes()


def world_reply(command: object) -> object:
    world = World()
    world.ready()
    world.run(0.2)
    return world.ask(command)
