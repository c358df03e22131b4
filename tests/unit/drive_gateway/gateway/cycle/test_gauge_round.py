"""Current and temperature of each axis, read beside everything else and never in its way."""

import struct

import pytest

from cell.messages import ReadObject
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.sdo import Sdo
from drive_gateway.config.settings import TemperatureSettings
from drive_gateway.gateway.cycle.gauge_round import ROUND_S
from drive_gateway.gateway.drives.gauge import MISSES, OLD_S
from tests.unit.gateway_world import CYCLE_S, FakeDrive, World, axis, gateway_settings

RATED, CURRENT, TEMPERATURE = (0x6075, 0), (0x6078, 0), (0x3201, 1)
J1 = axis("J1", 1, temperature=TemperatureSettings(TEMPERATURE, 2, True, 0.1))
J2 = axis("J2", 2, counts_per_unit=-100_000.0)


class SlowDrive(FakeDrive):
    """Keeps what it is asked for by frames until `answer`."""

    def __init__(self, *settings: object) -> None:
        super().__init__(*settings)
        self.asked: list[CanFrame] = []

    def take(self, frame: CanFrame) -> list[CanFrame]:
        if frame.id == 0x600 + self.id and frame.data[0] == 0x40 and self.alive:
            self.asked.append(frame)
            return []
        return super().take(frame)

    def answer(self) -> list[CanFrame]:
        return super().take(self.asked.pop())


def drives_world(**objects: object) -> World:
    """Two drives with 4 A of rated current that tell 250 and -500 per mille, the first one at 45.6 degC."""
    world = World(gateway_settings((J1, J2), **objects))
    for drive, per_mille in zip(world.drives.values(), (250, -500), strict=True):
        drive.objects |= {RATED: struct.pack("<I", 4000), CURRENT: struct.pack("<h", per_mille)}
    world.drives[1].objects[TEMPERATURE] = struct.pack("<h", 456)
    return world


def slow_world() -> tuple[World, SlowDrive]:
    """The first drive has not answered what it was asked for beside the cycle."""
    world = drives_world()
    slow = SlowDrive(J1, world.settings)
    slow.objects = world.drives[1].objects
    world.drives[1] = slow
    world.ready()
    world.until(lambda: slow.asked)
    return world, slow


def readings(world: World, node: int) -> list[tuple[int, int]]:
    """Index and sub-index of what was asked by frames."""
    asked = [frame.data for frame in world.frames if frame.id == 0x600 + node and frame.data[0] == 0x40]
    return [(int.from_bytes(data[1:3], "little"), data[3]) for data in asked]


def told(world: World) -> list[tuple[float | None, float | None]]:
    assert world.state is not None
    return [(node.current_a, node.temperature_c) for node in world.state.nodes]


def test_each_axis_tells_the_current_of_its_motor_and_where_it_is_known_a_temperature() -> None:
    world = drives_world()
    world.ready()
    world.run(5 * ROUND_S)
    # 250 per mille of 4 A; the second motor turns against its axis.
    assert told(world) == [(pytest.approx(1.0), pytest.approx(45.6)), (pytest.approx(2.0), None)]


def test_each_axis_is_asked_for_one_object_in_a_round_and_the_rated_current_once() -> None:
    world = drives_world()
    world.ready()
    world.frames.clear()
    world.run(10 * ROUND_S)
    assert 8 <= len(readings(world, 1)) <= 12
    assert readings(world, 2).count(RATED) == 1
    assert set(readings(world, 1)) == {RATED, CURRENT, TEMPERATURE}


def test_what_a_drive_has_not_is_asked_for_once_in_each_of_its_lives() -> None:
    world = drives_world()
    del world.drives[1].objects[TEMPERATURE], world.drives[2].objects[RATED]
    world.ready()
    world.run(10 * ROUND_S)
    assert (readings(world, 1).count(TEMPERATURE), readings(world, 2)) == (1, [RATED])
    assert told(world) == [(pytest.approx(1.0), None), (None, None)]
    world.tell(CanFrame(0x702, b"\0"))
    world.until(lambda: not world.state.ready)
    world.until(lambda: world.state.ready)
    world.run(5 * ROUND_S)
    assert readings(world, 2) == [RATED, RATED]


def test_a_current_without_a_rated_one_has_no_unit() -> None:
    world = drives_world()
    world.drives[2].objects[RATED] = bytes(4)
    world.ready()
    world.run(10 * ROUND_S)
    assert readings(world, 2) == [RATED] * MISSES
    assert told(world)[1] == (None, None)


def test_no_more_than_one_reading_is_open_on_a_bus() -> None:
    world, slow = slow_world()
    world.frames.clear()
    world.run(0.4)
    assert not readings(world, 2)
    world.tell(*slow.answer())
    world.until(lambda: readings(world, 2))


def test_a_dialogue_goes_out_in_the_cycle_in_which_it_would_without_a_reading() -> None:
    world, slow = slow_world()
    world.request(ReadObject(1, 0x6041, 0))
    sent = sent_in_the_next_cycles(world)
    beside = drives_world()
    beside.ready()
    beside.until(lambda: readings(beside, 1))
    beside.run(2 * CYCLE_S)
    beside.request(ReadObject(1, 0x6041, 0))
    assert requests(sent) == requests(sent_in_the_next_cycles(beside)) != []
    # The node is told to forget the reading before it is asked for something else.
    assert [type(each).__name__ for each in sent] == ["CanFrame", "Sdo"]
    assert sent[0].data == bytes.fromhex("80") + slow.asked[0].data[1:4] + bytes.fromhex("00000008")


def sent_in_the_next_cycles(world: World) -> list[object]:
    """What goes to the SDO server of node 1."""
    sent: list[object] = []
    take, sdo = world.drives[1].take, world.drives[1].sdo

    def seen(frame: CanFrame) -> list[CanFrame]:
        sent.extend([frame] if frame.id == 0x601 else [])
        return take(frame)

    def asked(request: Sdo) -> object:
        sent.append(request)
        return sdo(request)

    world.drives[1].take, world.drives[1].sdo = seen, asked
    world.run(3 * CYCLE_S)
    world.drives[1].take, world.drives[1].sdo = take, sdo
    return sent


def requests(sent: list[object]) -> list[tuple[int, int]]:
    return [(each.index, each.sub) for each in sent if isinstance(each, Sdo)]


def test_a_late_answer_to_what_was_forgotten_is_none() -> None:
    world, slow = slow_world()
    late = slow.answer()
    world.request(ReadObject(1, 0x6041, 0))
    world.run(2 * CYCLE_S)
    world.tell(*late)
    world.run(0.3)
    assert told(world)[0] == (None, None)


def test_a_node_that_dies_while_it_is_asked_is_brought_up_as_soon_as_any_other() -> None:
    """Its first request after the boot-up does not wait for the reading, whose time is long."""

    def back_after_s(asked: bool) -> float:
        world = drives_world(sdo_timeout_s=5.0)
        slow = SlowDrive(J1, world.settings)
        slow.objects = world.drives[1].objects
        world.drives[1] = slow
        world.ready()
        world.until(lambda: slow.asked)
        if not asked:
            world.tell(*slow.answer())
            world.run(2 * CYCLE_S)
        slow.alive = False
        world.until(lambda: not world.state.ready)
        slow.alive = True
        began = world.now
        world.until(lambda: world.state.ready)
        return world.now - began

    assert back_after_s(asked=True) == pytest.approx(back_after_s(asked=False), abs=0.02)


def test_an_old_value_is_not_told() -> None:
    world, slow = slow_world()
    world.tell(*slow.answer())
    world.until(lambda: slow.asked)
    world.tell(*slow.answer())
    world.until(lambda: told(world)[0] != (None, None), within_s=1.0)
    world.run(OLD_S + 0.5)
    assert told(world)[0] == (None, None)


def test_a_drive_that_does_not_answer_is_left_alone_until_its_next_start() -> None:
    world, slow = slow_world()
    world.run(20.0)
    assert len(slow.asked) == 2 * MISSES
    world.run(5.0)
    assert len(slow.asked) == 2 * MISSES
    assert told(world)[1] == (pytest.approx(2.0), None)
    assert world.state.ready
