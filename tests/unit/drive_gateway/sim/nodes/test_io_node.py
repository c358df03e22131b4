"""The simulated I/O node as CiA 401 describes one, byte by byte, without a gateway."""

import pytest

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.sim.nodes.io_node import SimulatedIoNode

NODE = 20
SYNC = CanFrame(0x080, b"")


class Master:
    """Sends frames to one node; time goes on by 10 ms with each."""

    def __init__(self, input_bytes: int = 2, output_bytes: int = 2) -> None:
        self.node = SimulatedIoNode(NODE, input_bytes, output_bytes)
        self.now = 0.0
        self.step()
        self.booted = [frame for _ in range(3) for frame in self.step()]

    def step(self) -> list[CanFrame]:
        self.now += 0.01
        return self.node.step(self.now)

    def send(self, cob_id: int, data: str = "") -> list[CanFrame]:
        self.now += 0.01
        return self.node.receive(CanFrame(cob_id, bytes.fromhex(data)), self.now)

    def nmt(self, command: int) -> None:
        self.send(0x000, f"{command:02x}{NODE:02x}")

    def sdo(self, request: str) -> str:
        (answer,) = self.send(0x600 + NODE, request)
        return answer.data.hex()

    def write(self, index: int, sub: int, data: str) -> None:
        head = 0x23 | (4 - len(data) // 2) << 2
        answer = self.sdo(f"{head:02x}{index.to_bytes(2, 'little').hex()}{sub:02x}{data.ljust(8, '0')}")
        assert answer.startswith("60"), answer


def test_it_says_what_it_is_and_how_much_it_has() -> None:
    master = Master(2, 1)
    assert master.booted == [CanFrame(0x700 + NODE, b"\0")]
    assert master.sdo("4000100000000000") == "4300100091010300"
    assert master.sdo("4000600000000000") == "4f00600002000000"
    assert master.sdo("4000620000000000") == "4f00620001000000"
    assert master.sdo("4000620200000000") == "8000620211000906"
    assert master.sdo("4001" + "160000000000")[:2] == "4f"
    assert master.sdo("40001a0000000000") == "4f001a0002000000"


def test_what_it_has_not_got_is_no_object() -> None:
    master = Master(1, 0)
    assert master.sdo("4000620100000000") == "8000620100000206"
    assert master.sdo("4006620100000000") == "8006620100000206"


def test_its_inputs_come_on_change_from_the_factory() -> None:
    master = Master()
    master.nmt(1)
    assert master.step() == [CanFrame(0x180 + NODE, b"\0\0")]
    assert master.step() == []
    master.node.set_input(9, True)
    assert master.step() == [CanFrame(0x180 + NODE, b"\0\x02")]
    assert master.send(0x080) == []


def test_its_inputs_come_with_each_nth_sync_where_the_type_says_so() -> None:
    master = Master()
    master.write(0x1800, 2, "02")
    master.nmt(1)
    answers = [len(master.send(0x080)) for _ in range(4)]
    assert answers == [0, 1, 0, 1]


def test_outputs_act_on_arrival_from_the_factory_and_with_sync_where_the_type_says_so() -> None:
    master = Master()
    master.nmt(1)
    master.send(0x200 + NODE, "0102")
    assert master.node.outputs == 0x0201
    master.nmt(0x80)
    master.write(0x1400, 2, "01")
    master.nmt(1)
    master.send(0x200 + NODE, "ffff")
    assert master.node.outputs == 0x0201
    master.send(0x080)
    assert master.node.outputs == 0xFFFF


@pytest.mark.parametrize("nmt", [0x02, 0x82])
def test_without_its_master_an_output_takes_its_error_value_or_keeps_its_own(nmt: int) -> None:
    master = Master()
    master.write(0x6206, 1, "f0")
    master.write(0x6207, 1, "30")
    master.nmt(1)
    master.send(0x200 + NODE, "c5ff")
    master.nmt(nmt)
    assert master.node.outputs == 0x0035


def test_a_heartbeat_that_it_misses_is_such_a_failure_and_is_told() -> None:
    master = Master()
    master.write(0x1016, 1, "64007f00")
    master.nmt(1)
    master.send(0x77F, "05")
    master.send(0x200 + NODE, "ffff")
    sent = [frame for _ in range(15) for frame in master.step()]
    assert master.node.outputs == 0
    assert CanFrame(0x080 + NODE, bytes.fromhex("3081110000000000")) in sent


def test_after_its_supply_has_failed_all_outputs_are_off_and_inputs_are_measured() -> None:
    master = Master()
    master.node.set_input(0, True)
    master.write(0x6206, 1, "00")
    master.write(0x6200, 1, "ff")
    master.node.power_cycle()
    assert master.node.outputs == 0
    for _ in range(4):
        master.step()
    assert master.sdo("4006620100000000") == "4f066201ff000000"
    assert master.sdo("4000600100000000") == "4f00600101000000"


def test_inputs_are_set_by_the_makers_own_object_and_only_those_that_there_are() -> None:
    master = Master(1, 1)
    master.write(0x2021, 1, "07")
    assert master.sdo("4000600100000000") == "4f00600180000000"
    master.write(0x2021, 2, "07")
    assert master.sdo("4000600100000000") == "4f00600100000000"
    assert master.sdo("2f21200108000000") == "8021200130000906"
