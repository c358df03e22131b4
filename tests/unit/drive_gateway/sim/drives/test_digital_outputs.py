"""60FEh of a simulated drive: mask, process data, and who switches it off."""

import struct

import pytest

from tests.unit.sim_drive_world import NODE, Bench

OUTPUTS, MASK = 0x60FE0120, 0x0F


def bench(transmission: int = 1) -> Bench:
    """RPDO3 carries the outputs, of which four bits count."""
    bench = Bench()
    bench.boot()
    bench.write(0x60FE, 2, MASK, 4)
    for index, sub, value, size in (
        (0x1402, 1, 0x80000400 + NODE, 4), (0x1402, 2, transmission, 1), (0x1602, 0, 0, 1), (0x1602, 1, OUTPUTS, 4),
        (0x1602, 0, 1, 1), (0x1402, 1, 0x400 + NODE, 4),
    ):  # fmt: skip
        bench.write(index, sub, value, size)
    bench.nmt(0x01)
    return bench


def told(world: Bench, word: int) -> int:
    """What is on after an RPDO and a SYNC."""
    world.send(0x400 + NODE, struct.pack("<I", word))
    world.send(0x080, b"")
    return world.node.outputs[0].on


def test_only_bits_of_the_mask_are_switched_and_all_can_be_read_back() -> None:
    world = bench()
    assert told(world, 0xA5) == 0x05
    assert world.read(0x60FE, 1) == 0xA5
    world.write(0x60FE, 2, 0xFF, 4)
    assert world.node.outputs[0].on == 0xA5


def test_a_synchronous_rpdo_switches_with_the_sync() -> None:
    world = bench()
    world.send(0x400 + NODE, struct.pack("<I", 1))
    assert world.node.outputs[0].on == 0
    world.send(0x080, b"")
    assert world.node.outputs[0].on == 1


@pytest.mark.parametrize("command", [0x02, 0x81, 0x82])
def test_nmt_stop_and_resets_switch_off(command: int) -> None:
    world = bench()
    assert told(world, 1) == 1
    world.nmt(command)
    assert world.node.outputs[0].on == 0


def test_a_lost_master_switches_off_whatever_6007h_says() -> None:
    world = bench()
    world.write(0x6007, 0, 0, 2)
    world.write(0x1016, 1, 0x7F << 16 | 100, 4)
    world.send(0x77F, b"\x05")
    assert told(world, 1) == 1
    world.wait(0.2)
    assert world.node.outputs[0].on == 0


def test_outputs_are_off_after_power_on_and_are_no_parameters_to_store() -> None:
    world = bench()
    assert told(world, 1) == 1
    world.write(0x1010, 1, 0x65766173, 4)
    world.node.power_cycle()
    world.boot()
    assert (world.read(0x60FE, 1), world.read(0x60FE, 2)) == (0, 0)
