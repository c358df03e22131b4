"""Process data for motions of the drives' own, in the drives file."""

from pathlib import Path

import pytest

from cell.commands.checks import check_cell
from cell.config import ConfigError
from drive_gateway.canopen.bus_load import frame_bits
from drive_gateway.canopen.profile_pdos import ProfileSender
from drive_gateway.config import AxisSettings, load_drives
from drive_gateway.config.image import image_of
from tests.unit.config_world import CONFIGS, Copy

GANTRY = "festo_gantry/drives.yaml"


def gantry_axis() -> AxisSettings:
    """The axis of node 1."""
    return load_drives(CONFIGS / GANTRY, "gantry_bus").robots["gantry"].axes[0]


def test_the_gantry_cell_is_good_and_maps_what_the_thesis_maps() -> None:
    bundle, problems = check_cell(CONFIGS / "festo_gantry" / "cell.yaml")
    assert bundle is not None
    assert not problems
    axis = gantry_axis()
    pdos = axis.profile_pdos
    assert pdos is not None
    assert pdos.rpdos == ((0x60400010,), (0x607A0020, 0x60820020), (0x60FF0020,))
    assert pdos.tpdos == ((0x60410010, 0x60640020), (0x606C0020, 0x20740020))
    sizes = (2, 8, 4, 6, 8)
    assert image_of(axis).timed_bits_s == pytest.approx(sum(frame_bits(size) for size in sizes) / 0.04)


def test_the_tpdos_and_heartbeats_of_six_nodes_load_500_kbit_per_s_as_computed_by_hand() -> None:
    tpdos = 6 * (frame_bits(6) + frame_bits(8)) / 0.04 / 500_000
    assert tpdos == pytest.approx(0.075, abs=0.0015)
    assert 6 * frame_bits(1) / 0.5 / 500_000 == pytest.approx(0.0016, abs=1e-4)


def test_tpdo1_of_node_1_is_linked_byte_by_byte_as_in_the_thesis_with_its_period_as_event_timer_too() -> None:
    pdos = image_of(gantry_axis()).pdos
    writes = [write for pdo in pdos for write in pdo.writes() if write.index in (0x1800, 0x1A00)]
    made = [(f"{write.index:04X}:{write.sub}", write.data.hex(" ")) for write in writes]
    assert made == [
        ("1800:1", "81 01 00 80"),
        ("1800:2", "fe"),
        ("1800:3", "90 01"),
        ("1800:5", "28 00"),
        ("1A00:0", "00"),
        ("1A00:1", "10 00 41 60"),
        ("1A00:2", "20 00 64 60"),
        ("1A00:0", "02"),
        ("1800:1", "81 01 00 00"),
    ]


def test_an_rpdo_is_sent_when_it_changes_and_every_period_and_the_target_before_the_controlword() -> None:
    sender = ProfileSender(image_of(gantry_axis()).profile)

    def sent(now: float, word: int, target: int, velocity: int) -> list[tuple[int, str]]:
        values = {0x6040: word, 0x607A: target, 0x60FF: velocity}
        return [(frame.id, frame.data.hex(" ")) for frame in sender.frames(values, now)]

    assert sent(1.0, 0x0F, 0, 0) == [(0x301, "00 00 00 00 00 00 00 00"), (0x401, "00 00 00 00"), (0x201, "0f 00")]
    assert sent(1.01, 0x1F, 400, 0) == [(0x301, "90 01 00 00 00 00 00 00"), (0x201, "1f 00")]
    assert sent(1.02, 0x1F, 400, -100) == [(0x401, "9c ff ff ff")]
    assert sent(1.03, 0x1F, 400, -100) == []
    assert len(sent(1.06, 0x1F, 400, -100)) == 3


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("period_s: 0.04", "period_s: 7", "period_s: found 7, allowed 0.001 to 6.5, whole milliseconds"),
        ("period_s: 0.04", "period_s: 0.0405", "period_s: found 0.0405, allowed 0.001 to 6.5, whole milliseconds"),
        ("[0x606C0020, 0x20740020]", "[0x606C0020, 0x20740020, 0x60410010]", "tpdo2: found 80 bits"),
        ("[0x607A0020, 0x60820020]", "[0x607A0020, 0x60810020]", "rpdo2: found 0x60810020, allowed one of 0x60400010"),
        (
            "{node: 1,",
            "{node: 1, feed_forward: velocity,",
            "rpdo3: found rpdo3 beside the feed",
        ),
        ("[0x60FF0020]", "[]", "profile_pdos: found 60FFh in 0 RPDOs, allowed in one of rpdo1, rpdo2 and rpdo3"),
    ],
)
def test_each_mistake_is_one_line(tmp_path: Path, old: str, new: str, problem: str) -> None:
    copy = Copy(tmp_path).change(GANTRY, old, new)
    with pytest.raises(ConfigError) as caught:
        load_drives(copy.folder / GANTRY, "gantry_bus")
    assert len(caught.value.problems) == 1
    assert problem in str(caught.value.problems[0])
