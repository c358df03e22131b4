"""What goes over the wire, byte by byte (`tests/vectors/canopen_bytes.json`)."""

import queue
from contextlib import nullcontext
from dataclasses import replace

import pytest

from cell.messages import AxisStatus
from drive_gateway.canopen.abort_text import abort_text
from drive_gateway.canopen.emcy import decode_emergency
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.nmt import SYNC_FRAME, NmtCommand, NmtState, heartbeat_frame, nmt_frame
from drive_gateway.canopen.pdo_map import COMMAND, process_image
from drive_gateway.canopen.profile_pdos import ProfileSender
from drive_gateway.canopen.sdo import Sdo, SdoDone
from drive_gateway.cia402.state_machine import decode
from drive_gateway.config import load_drives
from drive_gateway.config.image import image_of
from drive_gateway.gateway.bus.sdo_workers import SdoWorkers
from drive_gateway.sim.services.dictionary import key_of, load_dictionary
from drive_gateway.sim.services.objects import Objects
from drive_gateway.sim.services.pdo import transmit_pdos
from tests.unit.repository import ROOT, vectors
from tests.unit.sim_drive_world import AXIS, Bench

VECTORS = vectors("canopen_bytes.json")
GANTRY = ROOT / "cell_configs" / "festo_gantry" / "drives.yaml"
WHAT = {"ids": lambda vector: vector["what"] if isinstance(vector, dict) else None}


def bench_at(position: int) -> Bench:
    """Node 1, enabled in profile position, arrived at `position` [counts]."""
    bench = Bench(replace(AXIS, node_id=1))
    bench.prepare()
    bench.write(0x6060, 0, 1, 1)
    bench.write(0x6065, 0, 1_000_000, 4)
    bench.enable()
    bench.cycle(0x0F, position)
    for _ in range(5):
        bench.cycle(0x1F, position)
    while not bench.cycle(0x0F, position)[0] & 1 << 10:
        pass
    for _ in range(100):
        bench.cycle(0x0F, position)
    return bench


@pytest.mark.parametrize("vector", VECTORS["sdo"], **WHAT)
def test_a_node_answers_an_sdo(vector: dict[str, str]) -> None:
    answers = bench_at(int(vector.get("position", 400))).send(0x601, bytes.fromhex(vector["request"]))
    assert [(frame.id, frame.data.hex(" ").upper()) for frame in answers] == [(0x581, vector["answer"])]


def test_a_long_value_is_read_in_segments() -> None:
    bench = Bench(replace(AXIS, node_id=1))
    bench.boot()
    first = bench.send(0x601, bytes.fromhex("4008100000000000"))[0].data
    assert first[:4] == bytes.fromhex("41081000")
    length, text, toggle = int.from_bytes(first[4:], "little"), b"", 0
    while len(text) < length:
        part = bench.send(0x601, bytes([0x60 | toggle]) + bytes(7))[0].data
        assert part[0] & 0x10 == toggle
        text += part[1 : 8 - (part[0] >> 1 & 7)]
        toggle ^= 0x10
    assert part[0] & 1
    assert text == b"zencell simulated drive"


def test_process_data_of_a_drive_at_its_target() -> None:
    bench = bench_at(400)
    assert bench.sent_on(0x181)[-1].hex(" ") == "37 06 90 01 00 00"
    assert COMMAND.pack(0x1F, 400).hex(" ") == "1f 00 90 01 00 00"
    assert process_image(1).status_layout.unpack(bytes.fromhex("370690010000")) == (0x0637, 400)


@pytest.mark.parametrize("vector", VECTORS["client"], **WHAT)
def test_the_gateway_asks_by_sdo(vector: dict[str, str]) -> None:
    sent: queue.SimpleQueue[CanFrame] = queue.SimpleQueue()
    done: queue.SimpleQueue[SdoDone] = queue.SimpleQueue()
    data = None if vector["data"] is None else bytes.fromhex(vector["data"])
    with SdoWorkers([1], sent.put, nullcontext, done.put, 0.5) as workers:
        workers.submit(Sdo("1/1", 1, int(vector["index"]), int(vector["sub"]), data))
        frame = sent.get(timeout=10)
        answer = (b"\x60" if data else b"\x4b") + frame.data[1:4] + bytes(4)
        workers.take(CanFrame(0x581, bytes.fromhex(vector.get("answer", answer.hex()))))
        outcome = done.get(timeout=10)
    assert not outcome.problem
    assert outcome.data == bytes.fromhex(vector.get("value", outcome.data.hex()))
    assert (frame.id, frame.data.hex(" ").upper()) == (0x601, vector["request"])


def test_a_guarded_node_answers_with_a_toggle_bit_that_alternates() -> None:
    bench = Bench()
    bench.prepare()
    cob_id = int(VECTORS["guarding"]["id"], 16)
    answers = [bench.send(cob_id, b"", remote=True)[0] for _ in range(4)]
    assert {frame.id for frame in answers} == {cob_id}
    assert [frame.data.hex() for frame in answers] == VECTORS["guarding"]["answers"] * 2


def test_process_data_of_motions_of_the_drives_own() -> None:
    pdos = image_of(load_drives(GANTRY, "gantry_bus").robots["gantry"].axes[0]).profile
    for vector in VECTORS["profile"]["rpdos"]:
        values = {0x6040: int(vector["word"], 16), 0x607A: vector["target"], 0x60FF: vector["velocity"]}
        frames = ProfileSender(pdos).frames(values, 0.0)
        assert {f"{frame.id:03X}": frame.data.hex(" ").upper() for frame in frames} == vector["frames"]
    objects = Objects(load_dictionary(), 1)
    for write in (write for pdo in pdos for write in pdo.writes()):
        objects.numbers[key_of(write.index, write.sub)] = int.from_bytes(write.data, "little")
    wanted = VECTORS["profile"]["tpdo2"]
    objects.numbers[key_of(0x606C)], objects.numbers[key_of(0x2074)] = wanted["velocity"], wanted["filtered"]
    sent = {f"{pdo.cob_id:03X}": pdo.frame().data.hex(" ").upper() for pdo in transmit_pdos(objects)}
    assert sent[wanted["id"]] == wanted["data"]


def test_network_management_sync_and_heartbeats() -> None:
    made = [
        nmt_frame(NmtCommand.START, 1),
        nmt_frame(NmtCommand.ENTER_PRE_OPERATIONAL, 0),
        nmt_frame(NmtCommand.STOP, 3),
        SYNC_FRAME,
        *(heartbeat_frame(state, 3) for state in (NmtState.BOOT_UP, NmtState.PRE_OPERATIONAL)),
        *(heartbeat_frame(state, 3) for state in (NmtState.OPERATIONAL, NmtState.STOPPED)),
    ]
    wanted = [(vector["id"], vector["data"]) for vector in VECTORS["frames"]]
    assert [(f"{frame.id:03X}", frame.data.hex(" ").upper()) for frame in made] == wanted


def test_a_pdo_is_mapped_in_the_prescribed_order() -> None:
    writes = process_image(1).status.writes()
    heads = [bytes([0x23 | 4 - len(write.data) << 2]) + write.index.to_bytes(2, "little") for write in writes]
    made = [
        (head + bytes([write.sub]) + write.data).hex(" ").upper() for head, write in zip(heads, writes, strict=True)
    ]
    assert made == VECTORS["mapping"]["requests"]


@pytest.mark.parametrize(("word", "state"), VECTORS["states"].items())
def test_a_statusword_shows_its_state(word: str, state: str) -> None:
    assert decode(int(word, 16)) is AxisStatus[state]


def test_of_128_patterns_of_a_statusword_24_are_states() -> None:
    fault_patterns = sum(1 for bits in range(128) if bits & 0x4F == 0x0F)
    assert sum(decode(bits) is not None for bits in range(128)) == 24
    assert fault_patterns == 4


def test_a_following_error_is_told_as_an_emergency() -> None:
    emergency = decode_emergency(bytes.fromhex("1186210000000000"))
    assert emergency is not None
    assert (emergency.code, emergency.register) == (0x8611, 0x21)
    bench = Bench(replace(AXIS, node_id=1))
    bench.prepare()
    bench.node.raise_emergency(0x8611)
    bench.wait(0.01)
    assert bench.sent_on(0x081)[-1].hex(" ") == "11 86 21 00 00 00 00 00"


ALL_ABORTS = """05030000 05040000 05040001 05040002 05040003 05040004 05040005 06010000 06010001 06010002 06020000
06040041 06040042 06040043 06040047 06060000 06070010 06070012 06070013 06090011 06090030 06090031 06090032 06090036
060A0023 08000000 08000020 08000021 08000022 08000023 08000024"""


def test_every_sdo_abort_has_a_name() -> None:
    texts = [abort_text(int(code, 16)) for code in ALL_ABORTS.split()]
    assert len(set(texts)) == len(texts)
    assert not any("not in CiA 301" in text for text in texts)
    assert abort_text(0x06020000) == "abort 06020000h, object does not exist"
    assert abort_text(0x12345678) == "abort 12345678h, code not in CiA 301"


@pytest.mark.parametrize("code", ALL_ABORTS.split())
def test_every_sdo_abort_reaches_the_caller_by_name(code: str) -> None:
    sent: queue.SimpleQueue[CanFrame] = queue.SimpleQueue()
    done: queue.SimpleQueue[SdoDone] = queue.SimpleQueue()
    with SdoWorkers([1], sent.put, nullcontext, done.put, 0.5) as workers:
        workers.submit(Sdo("1/1", 1, 0x6041, 0, None))
        frame = sent.get(timeout=10)
        workers.take(CanFrame(0x581, b"\x80" + frame.data[1:4] + int(code, 16).to_bytes(4, "little")))
        outcome = done.get(timeout=10)
    assert outcome.abort_code == int(code, 16)
    assert outcome.problem == abort_text(int(code, 16))
