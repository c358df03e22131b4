"""In which order, and in which state, a node lets its PDOs be linked."""

from dataclasses import replace

import pytest

from tests.unit.repository import vectors
from tests.unit.sim_drive_world import AXIS, NODE, Bench, Refused

VECTORS = vectors("sdo_frames.json")


@pytest.fixture
def bench() -> Bench:
    world = Bench()
    world.boot()
    return world


def refusal(bench: Bench, index: int, sub: int, value: int, size: int) -> int:
    with pytest.raises(Refused) as caught:
        bench.write(index, sub, value, size)
    return caught.value.code


def test_recorded_linking_of_tpdo1_is_accepted() -> None:
    bench = Bench(replace(AXIS, node_id=1))
    bench.boot()
    answers = [bench.send(0x601, bytes.fromhex(request))[0].data[0] for request in VECTORS["linking_tpdo1_node_1"]]
    assert answers == [0x60] * len(answers)


def test_mapping_of_a_valid_pdo_is_refused(bench: Bench) -> None:
    bench.write(0x1400, 1, 0x200 + NODE, 4)
    assert refusal(bench, 0x1600, 0, 0, 1) == 0x08000022


def test_cob_id_of_a_valid_pdo_is_refused(bench: Bench) -> None:
    bench.write(0x1400, 1, 0x200 + NODE, 4)
    assert refusal(bench, 0x1400, 1, 0x300 + NODE, 4) == 0x08000022


def test_cob_id_may_change_together_with_disabling(bench: Bench) -> None:
    bench.write(0x1400, 1, 0x200 + NODE, 4)
    bench.write(0x1400, 1, 0x80000300 + NODE, 4)
    assert bench.read(0x1400, 1) == 0x80000300 + NODE


@pytest.mark.parametrize("identifier", [0x000, 0x080, 0x100, 0x583, 0x603, 0x703, 0x800, 0x20000000])
def test_identifier_of_another_service_is_refused(bench: Bench, identifier: int) -> None:
    assert refusal(bench, 0x1400, 1, 0x80000000 | identifier, 4) == 0x06090030


def test_entry_is_refused_while_the_count_is_not_zero(bench: Bench) -> None:
    assert refusal(bench, 0x1600, 1, 0x607A0020, 4) == 0x06010000


@pytest.mark.parametrize(
    ("index", "entry", "code"),
    [
        (0x1600, 0x30000010, 0x06020000),
        (0x1600, 0x10180910, 0x06090011),
        (0x1600, 0x60850020, 0x06040041),
        (0x1600, 0x60410010, 0x06040041),
        (0x1600, 0x607A0010, 0x06040041),
    ],
)
def test_object_that_cannot_be_mapped_is_refused(bench: Bench, index: int, entry: int, code: int) -> None:
    bench.write(index, 0, 0, 1)
    assert refusal(bench, index, 1, entry, 4) == code


def test_more_than_64_bits_are_refused(bench: Bench) -> None:
    bench.write(0x1A00, 0, 0, 1)
    for sub in (1, 2, 3):
        bench.write(0x1A00, sub, 0x60640020, 4)
    assert refusal(bench, 0x1A00, 0, 3, 1) == 0x06040042


def test_count_over_empty_entries_is_refused(bench: Bench) -> None:
    assert refusal(bench, 0x1603, 0, 2, 1) == 0x06040041


@pytest.mark.parametrize("kind", [241, 252, 253])
def test_reserved_transmission_type_is_refused(bench: Bench, kind: int) -> None:
    assert refusal(bench, 0x1800, 2, kind, 1) == 0x06090030


@pytest.mark.parametrize(("index", "sub", "size"), [(0x1400, 1, 4), (0x1800, 2, 1), (0x1800, 5, 2), (0x1A00, 0, 1)])
def test_no_pdo_parameter_changes_in_operational(bench: Bench, index: int, sub: int, size: int) -> None:
    value = bench.read(index, sub)
    bench.nmt(0x01)
    assert refusal(bench, index, sub, value, size) == 0x08000022


def test_sub_index_without_an_object_is_refused(bench: Bench) -> None:
    assert refusal(bench, 0x1800, 4, 0, 1) == 0x06090011
