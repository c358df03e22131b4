"""Drives with habits that standards and manuals tell of: each runs, or one sentence says what it lacks and what helps.

Whatever a drive does, nothing moves that was not meant to (`UnkindBench` looks in every cycle).
"""

import numpy as np
import pytest

from cell.messages import AxisStatus, Home, MoveAxes
from drive_gateway.canopen.cob_id import SYNC
from drive_gateway.sim.nodes.node import SimulatedNode
from tests.sim.unkind.bench import PLAIN, UNKIND, WAY, Changes, Refused, UnkindBench, life, lived
from tests.sim.unkind.expected import REFUSED, TOLD, table
from tests.sim.unkind.traits.habits import answers_late
from tests.sim.unkind.traits.register import TRAITS
from tests.sim.unkind.traits.trait import Trait
from tests.unit.repository import ROOT

HELPED = [name for name, expected in REFUSED.items() if expected.helped_by is not None]


@pytest.mark.parametrize("name", TRAITS)
def test_a_drive_runs_or_one_sentence_says_what_it_lacks_and_what_helps(name: str) -> None:
    expected = REFUSED.get(name)
    if expected is None:
        world = life([TRAITS[name]])
        assert world.strange_syncs == 0
        told = [event.text for event in world.events if event.code == "object_missing"]
        assert all(TOLD.get(name, "nothing") in text or "TPDO 4" in text for text in told)
        assert bool(told) == (name in TOLD)
        return
    with pytest.raises(Refused) as refused:
        life([TRAITS[name]], hopeless=True)
    for part in expected.tells:
        assert part in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("name", HELPED)
def test_what_the_sentence_names_helps(name: str) -> None:
    changes = REFUSED[name].helped_by
    assert changes is not None
    life([TRAITS[name]], changes)


def test_a_sync_with_a_counter_is_sent_where_the_file_says_so() -> None:
    world = UnkindBench([TRAITS["sync_with_counter"]], Changes({"sync_counter": 3}, {}))
    TRAITS["sync_with_counter"].give(world.bus.nodes[PLAIN])
    lived(world)
    counts = [frame.data for frame in world.frames if frame.id == SYNC][:4]
    assert counts == [b"\1", b"\2", b"\3", b"\1"]


def test_a_drive_without_a_counter_is_told_where_the_file_wants_one() -> None:
    with pytest.raises(Refused, match=r"refused read of 1019h:00 \(SYNC counter, expected 3\).*leave out sync_counter"):
        life([], Changes({"sync_counter": 3}, {}), hopeless=True)


def test_a_gateway_may_have_another_node_id_which_the_drives_watch() -> None:
    world = life([], Changes({"node_id": 5}, {}))
    assert world.bus.nodes[UNKIND].objects.numbers[0x1016 << 8 | 1] >> 16 == 5
    assert 0x705 in {frame.id for frame in world.frames}


def test_a_drive_keeps_node_id_127_where_the_gateway_has_another_one() -> None:
    world = life([], Changes({"node_id": 5}, {"node_id": 127}))
    assert world.bus.nodes[127].objects.numbers[0x1016 << 8 | 1] >> 16 == 5


def test_a_node_that_restarted_under_load_is_back_and_stays_off() -> None:
    world = UnkindBench([TRAITS["restarts_under_load"]])
    world.comes_up()
    world.stands(False)
    assert world.set_up(Home("left", ())) == "stopped"
    world.until(lambda: world.state is not None and world.state.ready)
    world.stands()
    world.run(1.0)
    assert world.feedback is not None
    assert not world.feedback.enabled


def test_nothing_is_set_up_before_the_drives_have_said_in_which_units() -> None:
    world = UnkindBench([TRAITS["slow_sdo"]], Changes({}, {"incremental": False, "homing": None}))
    told: list[str] = []
    while not (reply := world.ask(MoveAxes("left", {"J1": 0.1}, True, 1.0, False))).ok:
        told.append(reply.text)
        assert world.now < 30.0, told[-1]
    assert "left stays off: the units of node 1 (left J1) are being read (60A9h, 60AAh); ask again" in told[-1]


@pytest.mark.parametrize("units", ["speeds in rpm", "velocities against positions"])
def test_units_are_tried_as_well_where_sdo_takes_long(units: str) -> None:
    world = UnkindBench([TRAITS[units]])
    world.comes_up()
    answers_late(world.bus.nodes[UNKIND], 0.4)
    before = world.places
    with pytest.raises(Refused) as refused:
        world.homes()
    assert any(part in str(refused.value) for part in REFUSED[units].tells)
    assert np.abs(world.places - before).max() < np.radians(1.0)


def _drifts(node: SimulatedNode) -> None:
    """It moves although it was told to stand."""
    timed = node.timers

    def timers():  # type: ignore[no-untyped-def]
        node.servo.position += 40.0
        return timed()

    node.timers = timers  # type: ignore[method-assign]


def test_the_bench_notices_an_axis_that_moves_by_itself() -> None:
    with pytest.raises(AssertionError, match="was not meant to"):
        life([Trait("drifts", "", "", _drifts)])


def test_a_node_that_is_lost_again_before_its_stop_was_measured_is_brought_up_all_the_same() -> None:
    world = UnkindBench([], Changes({}, {"incremental": False, "homing": None}))
    world.comes_up()
    world.enables()
    world.half_way(WAY)
    node = world.bus.nodes[UNKIND]
    _drifts(node)
    world.bus.nodes[PLAIN].raise_emergency(0x4310)

    def heard() -> bool:
        assert world.state is not None
        return world.state.nodes[0].drive is not AxisStatus.SILENT

    world.until(lambda: "does_not_stop" in world.codes())
    world.until(lambda: not heard())
    world.until(heard)
    node.silence()
    world.until(lambda: not heard())
    del node.__dict__["timers"]
    node.silence(False)
    world.until(lambda: world.state is not None and world.state.ready)
    world.returns()


def test_the_page_about_drives_has_the_table_of_all_traits() -> None:
    page = (ROOT / "docs" / "drives.md").read_text()
    assert table() in page, "put what `python -m tests.sim.unkind.expected` prints into docs/drives.md"


def test_every_expectation_is_of_a_trait_that_there_is() -> None:
    assert {*REFUSED, *TOLD} <= set(TRAITS)
