"""Drives with habits that standards and manuals tell of: each runs, or one sentence says what it lacks and what helps.

Whatever a drive does, nothing moves that was not meant to (`UnkindBench` looks in every cycle).
"""

import random

import pytest

from cell.messages import Home
from drive_gateway.canopen.cob_id import SYNC
from drive_gateway.sim.nodes.node import SimulatedNode
from drive_gateway.sim.services.abort import AccessRefused
from drive_gateway.sim.traits.register import TRAITS
from drive_gateway.sim.traits.trait import Trait
from tests.sim.unkind.bench import PLAIN, UNKIND, Changes, Refused, UnkindBench, life, lived
from tests.sim.unkind.expected import REFUSED, TOLD, table
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


def test_the_page_about_drives_has_the_table_of_all_traits() -> None:
    page = (ROOT / "docs" / "drives.md").read_text()
    assert table() in page, "put what `python -m tests.sim.unkind.expected` prints into docs/drives.md"


def test_every_expectation_is_of_a_trait_that_there_is() -> None:
    assert {*REFUSED, *TOLD} <= set(TRAITS)


def refusal(names: list[str]) -> str | None:
    """What people are told of a drive with these traits; `None`: it runs, or they contradict each other."""
    try:
        life([TRAITS[name] for name in names], hopeless=any(name in REFUSED for name in names))
    except Refused as refused:
        return str(refused)
    except AccessRefused:
        # Of an object that another trait took away.
        return None
    return None


@pytest.mark.soak
def test_drives_with_several_habits_run_or_are_refused_with_a_sentence_and_never_move_by_themselves() -> None:
    rng = random.Random()
    for _ in range(100):
        names = rng.sample(sorted(TRAITS), rng.randint(2, 4))
        told = refusal(names)
        assert told is None or "node 1 (left J1)" in told, names
