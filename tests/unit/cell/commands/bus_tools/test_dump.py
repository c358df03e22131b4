"""Frames in words: by CiA 301 alone, and by what a drives file says of its nodes."""

import threading
from itertools import product
from pathlib import Path

import can
import pytest

from cell.commands.bus_tools import dump
from cell.commands.bus_tools.frame_text import FrameReader, Kind
from cell.commands.bus_tools.place import BusPlace, place_of
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.config.settings import BusSettings
from tests.unit.bus_tool_world import DEADLINE_S, ToolBus, sending, tool_bus
from tests.unit.config_world import DRIVES, TWO_ARMS, Copy

__all__ = ["tool_bus"]

PLAIN = FrameReader(BusPlace(BusSettings("virtual", "x", 1_000_000, {})))
LEFT = FrameReader(place_of(TWO_ARMS.parent / "left_drives.yaml", None, None, None, None))


@pytest.mark.parametrize(
    ("number", "data", "kind", "text"),
    [
        (0x000, "8105", Kind.NMT, "NMT reset node: node 5"),
        (0x000, "0100", Kind.NMT, "NMT start: all nodes"),
        (0x080, "", Kind.SYNC, "SYNC"),
        (0x085, "1186210102030405", Kind.EMCY, "EMCY node 5: 8611h following error over its window (register 21h, "
         "maker's 01 02 03 04 05); look for a collision or a blocked axis"),
        (0x185, "3702", Kind.TPDO, "TPDO1 node 5: 37 02"),
        (0x505, "0f00", Kind.RPDO, "RPDO4 node 5: 0f 00"),
        (0x605, "4041600000000000", Kind.SDO, "SDO node 5: read 6041h:00 Statusword"),
        (0x585, "4b41600037020000", Kind.SDO, "SDO node 5: 6041h:00 Statusword is 0237h Operation Enabled"),
        (0x605, "2b4060000f000000", Kind.SDO, "SDO node 5: write 6040h:00 Controlword = 000Fh enable"),
        (0x605, "237a6000fbffffff", Kind.SDO, "SDO node 5: write 607Ah:00 Target position in counts = -5 (FFFFFFFBh)"),
        (0x585, "6040600000000000", Kind.SDO, "SDO node 5: 6040h:00 Controlword is written"),
        (0x585, "8040600001000206", Kind.SDO, "SDO node 5: 6040h:00 Controlword: abort 06020001h, code not in CiA 301"),
        (0x605, "6000000000000000", Kind.SDO, "SDO node 5: to it, part of a longer transfer: 60 00 00 00 00 00 00 00"),
        (0x705, "00", Kind.HEARTBEAT, "heartbeat node 5: boot-up"),
        (0x705, "7f", Kind.HEARTBEAT, "heartbeat node 5: Pre-operational"),
        (0x77F, "05", Kind.HEARTBEAT, "heartbeat of the master: Operational"),
        (0x7E5, "0401000000000000", Kind.LSS, "LSS of a master: 04 01 00 00 00 00 00 00"),
        (0x085, "11", Kind.EMCY, "EMCY node 5: too short: 11"),
        (0x585, "11", Kind.SDO, "SDO node 5: 11 has 1 bytes, allowed are 8"),
        (0x000, "", Kind.NMT, "NMT ? "),
        (0x010, "aa", Kind.OTHER, "aa"),
    ],
    ids=lambda value: value if isinstance(value, str) else None,
)  # fmt: skip
def test_a_frame_says_what_cia_301_says_of_it(number: int, data: str, kind: Kind, text: str) -> None:
    said = PLAIN.read(CanFrame(number, bytes.fromhex(data)))
    assert (said.kind, said.text) == (kind, text)


def test_with_a_drives_file_process_data_are_shown_by_their_mapping() -> None:
    said = LEFT.read(CanFrame(0x181, bytes.fromhex("3702fbffffff")))
    assert said.text == (
        "TPDO1 node 1 (left.J1): Statusword 0237h Operation Enabled, Position actual value in counts -5 (FFFFFFFBh)"
    )
    assert LEFT.read(CanFrame(0x201, bytes.fromhex("0f0002000000"))).text.startswith(
        "RPDO1 node 1 (left.J1): Controlword 000Fh enable, Target position in counts 2 (00000002h)"
    )
    assert "37 02 is too short, 6 bytes are mapped" in LEFT.read(CanFrame(0x181, bytes.fromhex("3702"))).text


@pytest.mark.parametrize("reader", [PLAIN, LEFT], ids=["plain", "drives file"])
def test_no_frame_is_too_strange_to_be_shown(reader: FrameReader) -> None:
    for number, length, byte in product(range(0, 0x800, 13), range(9), (0x00, 0x20, 0x40, 0x43, 0x80, 0xFF)):
        assert reader.read(CanFrame(number, bytes([byte]) * length)).text or not length


class Stop(threading.Event):
    """Ctrl-C, after so many looks at it."""

    def __init__(self, looks: int) -> None:
        super().__init__()
        self.left = looks

    def is_set(self) -> bool:
        self.left -= 1
        return self.left < 0


def test_a_dump_shows_what_comes_and_never_sends(
    tmp_path: Path, tool_bus: ToolBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = Copy(tmp_path).change(DRIVES, "channel: two_arms_left", f'channel: "{tool_bus.channel}"')
    monkeypatch.setattr(dump, "stop_event", lambda: Stop(10))
    with sending(tool_bus.channel, 0x081, b"\x11\x86\x21") as peer:
        told = tool_bus.run("dump", str(copy.drives), "--kind", "emcy", "--node", "1")
        assert peer.recv(0.0) is None
        assert "  081  EMCY node 1 (left.J1): 8611h following error over its window" in told
        assert tool_bus.run("dump", "--kind", "sdo") == ""
        assert tool_bus.run("dump", "--node", "2") == ""
        assert tool_bus.run("dump", "--changed").count("EMCY") == 1
        assert tool_bus.run("dump", "--seconds", "0.1").count("EMCY") <= DEADLINE_S


def test_a_recording_is_shown_in_words(tmp_path: Path, tool_bus: ToolBus) -> None:
    log = tmp_path / "bus.log"
    with can.Logger(str(log)) as writer:
        for data in (b"\0", b"\5", b"\5"):
            writer.on_message_received(
                can.Message(timestamp=1.5, arbitration_id=0x701, data=data, is_extended_id=False, channel="x")
            )
    lines = tool_bus.run("dump", "--log", str(log), "--changed").splitlines()
    assert [line.partition("701  ")[2] for line in lines] == [
        "heartbeat node 1: boot-up",
        "heartbeat node 1: Operational",
    ]


@pytest.mark.parametrize(("suffix", "told"), [(".log", "cannot be read: "), (".asc", "holds no frame")])
def test_a_file_that_is_no_recording_is_told(tmp_path: Path, tool_bus: ToolBus, suffix: str, told: str) -> None:
    file = tmp_path / f"bus{suffix}"
    file.write_bytes(b"(no) recording at all\n" * 9)
    assert f"{file} {told}" in tool_bus.refused("dump", "--log", str(file))


def test_a_bus_of_another_process_is_to_be_recorded_there() -> None:
    told = ToolBus("x").refused("dump", str(TWO_ARMS), "left_bus")
    assert "it lives in its gateway's process; record it: drive-gateway log " in told
