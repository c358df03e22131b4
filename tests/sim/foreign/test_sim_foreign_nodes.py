"""Nodes of other CANopen stacks: what the gateway writes and sends is understood by code that never saw it.

`canopen.LocalNode` comes with the library that the gateway uses for its SDO client; durand shares nothing with either.
"""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from queue import Queue

import pytest

from drive_gateway.canopen.pdo_map import OwnPdo
from drive_gateway.canopen.sdo import Sdo, SdoDone
from drive_gateway.gateway.bus.sdo_workers import SdoWorkers
from tests.sim.foreign.drive import ForeignDrive
from tests.sim.foreign.nodes import (
    BIG,
    BIG_BYTES,
    CONSTANT,
    MEMORY,
    NOTE,
    NOTE_TEXT,
    ForeignNode,
    NodeOfCanopen,
    NodeOfDurand,
)
from tests.sim.unkind.bench import UNKIND, WAY, Changes, UnkindBench
from tests.unit.gateway_world import START

DEADLINE_S = 20.0


@pytest.fixture(params=[NodeOfCanopen, NodeOfDurand])
def kind(request: pytest.FixtureRequest) -> type[ForeignNode]:
    if request.param is NodeOfDurand:
        pytest.importorskip("durand", reason="a CANopen node of another maker: pip install durand")
    return request.param  # type: ignore[no-any-return]


@pytest.fixture
def world(kind: type[ForeignNode]) -> UnkindBench:
    """J1 has the foreign node, whose encoder is absolute; J2 a simulated drive."""
    lacks = frozenset({0x1016}) if kind is NodeOfDurand else frozenset()
    bench = UnkindBench((), Changes({}, {"incremental": False, "homing": None, "waived": lacks}))
    axis = bench.settings.robots["left"].axes[0]
    node = kind(UNKIND, ForeignDrive(round((START - axis.offset) * axis.counts_per_unit)))
    bench.bus.connect(node)
    return bench


def foreign(world: UnkindBench) -> ForeignNode:
    node = world.bus.nodes[UNKIND]
    assert isinstance(node, ForeignNode)
    return node


def test_it_is_configured_started_enabled_and_follows_every_set_point(world: UnkindBench) -> None:
    world.comes_up()
    owner = world.enables()
    before = foreign(world).position
    world.moves(owner, WAY)
    axis = world.settings.robots["left"].axes[0]
    assert foreign(world).position - before == pytest.approx(WAY * axis.counts_per_unit, abs=1)


def test_it_takes_pdos_of_other_numbers_and_identifiers() -> None:
    own = {"command": OwnPdo(3, 0x345), "status": OwnPdo(2, 0x6A1, (0x60410010, 0x60610008, 0x60640020))}
    bench = UnkindBench((), Changes({}, {"incremental": False, "homing": None, "own_pdos": own}))
    axis = bench.settings.robots["left"].axes[0]
    node = NodeOfCanopen(UNKIND, ForeignDrive(round((START - axis.offset) * axis.counts_per_unit)))
    bench.bus.connect(node)
    bench.comes_up()
    bench.moves(bench.enables(), WAY)
    sent = {frame.id for frame in bench.frames}
    assert 0x345 in sent
    assert 0x201 not in sent


def test_its_emergency_stops_the_robot_with_its_code_and_after_a_reset_it_goes_on(world: UnkindBench) -> None:
    world.comes_up()
    world.enables()
    node = foreign(world)
    node.drive.fail()
    node.emergency(0x4310, 0x09)
    world.until(lambda: any("4310h" in event.text for event in world.events), within_s=1.0)
    world.run(0.5)
    node.emergency(0, 0)
    world.moves(world.returns(), WAY)


def test_without_its_heartbeats_it_is_lost_and_brought_up_again_when_they_return(world: UnkindBench) -> None:
    world.comes_up()
    foreign(world).silent = True
    world.until(lambda: any(event.code == "heartbeat_lost" for event in world.events), within_s=1.0)
    foreign(world).silent = False
    world.until(lambda: world.state is not None and not world.state.ready, within_s=1.0)
    world.until(lambda: world.state is not None and world.state.ready, within_s=20.0)


@contextmanager
def workers(kind: type[ForeignNode]) -> Iterator["Asking"]:
    node = kind(5, ForeignDrive(0))
    node.step(1.0)
    yield Asking(node)


class Asking:
    """The gateway's SDO client, and the server of the other stack."""

    def __init__(self, node: ForeignNode) -> None:
        self._node = node
        self._done: Queue[SdoDone] = Queue()

    def ask(self, index: int, data: bytes | None = None, sub: int = 0) -> SdoDone:
        def send(frame: object) -> None:
            for answer in self._node.receive(frame, 1.0):  # type: ignore[arg-type]
                clients.take(answer)

        with SdoWorkers([self._node.node_id], send, nullcontext, self._done.put, 1.0) as clients:
            clients.submit(Sdo("1", self._node.node_id, index, sub, data))
            return self._done.get(timeout=DEADLINE_S)


def test_sdo_expedited_segmented_and_large_both_ways(kind: type[ForeignNode]) -> None:
    with workers(kind) as client:
        assert client.ask(MEMORY, (123456).to_bytes(4, "little")).problem == ""
        assert client.ask(MEMORY).data == (123456).to_bytes(4, "little")
        assert client.ask(NOTE).data == NOTE_TEXT
        assert client.ask(NOTE, b"a text that is longer than one segment").problem == ""
        assert client.ask(NOTE).data == b"a text that is longer than one segment"
        assert client.ask(BIG).data == BIG_BYTES
        assert client.ask(BIG, BIG_BYTES[::-1]).problem == ""
        assert client.ask(BIG).data == BIG_BYTES[::-1]


@pytest.mark.parametrize(
    ("index", "sub", "data", "code"),
    [
        (0x2FFF, 0, None, 0x06020000),
        (0x1018, 9, None, 0x06090011),
        (CONSTANT, 0, bytes(4), 0x06010002),
        (MEMORY, 0, bytes(2), 0x06070010),
    ],
)
def test_each_refusal_comes_with_its_code(
    kind: type[ForeignNode], index: int, sub: int, data: bytes | None, code: int
) -> None:
    with workers(kind) as client:
        refused = client.ask(index, data, sub)
        assert refused.abort_code == code, refused.problem
        assert refused.problem
