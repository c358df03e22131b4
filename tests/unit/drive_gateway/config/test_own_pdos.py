"""PDOs of an axis that are not as usual: number, identifier and mapping, and what no bus may have twice."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.config import ConfigError
from drive_gateway.canopen.pdo_map import OwnPdo, process_image
from drive_gateway.config import load_drives
from drive_gateway.config.image import image_of
from tests.unit.config_world import DRIVES, Copy

OLD = "{node: 2, gear: 200"


def copy_with(folder: Path, pdos: str) -> Copy:
    return Copy(folder).change(DRIVES, OLD, f"{{pdos: {pdos}, node: 2, gear: 200")


def test_without_the_key_all_is_as_usual() -> None:
    assert process_image(2) == process_image(2, own={"status": OwnPdo()})


def test_command_and_status_go_where_the_file_says(tmp_path: Path) -> None:
    copy = copy_with(tmp_path, "{command: {number: 3, cob_id: 0x345}, status: {number: 2}}")
    image = image_of(load_drives(copy.drives, "bus").robots["left"].axes[1])
    assert (image.command.number, image.command.cob_id) == (3, 0x345)
    assert (image.status.number, image.status.cob_id) == (2, 0x282)
    linked = [(write.index, write.sub, int.from_bytes(write.data, "little")) for write in image.command.writes()]
    assert linked[0] == (0x1402, 1, 0x80000345)
    assert linked[-1] == (0x1402, 1, 0x345)
    assert (0x1602, 2, 0x607A0020) in linked
    assert [frame.id for frame in image.frames(0x0F, 7)] == [0x345]


@given(
    before=st.lists(st.sampled_from([0x60610008, 0x606C0020]), max_size=1),
    between=st.lists(st.sampled_from([0x60610008, 0x10010008]), max_size=1),
    after=st.lists(st.sampled_from([0x60610008, 0x603F0010]), max_size=1),
    word=st.integers(0, 0xFFFF),
    counts=st.integers(-(2**31), 2**31 - 1),
)
def test_statusword_and_position_are_found_among_what_else_is_mapped(
    before: list[int], between: list[int], after: list[int], word: int, counts: int
) -> None:
    entries = (*before, 0x60410010, *between, 0x60640020, *after)
    layout = process_image(2, own={"status": OwnPdo(mapping=entries)}).status_layout
    values = {0x60410010: word, 0x60640020: counts}
    data = b"".join(
        values.get(entry, 0xA5).to_bytes((entry & 0xFF) // 8, "little", signed=values.get(entry, 0) < 0)
        for entry in entries
    )
    assert layout.size == len(data)
    assert layout.unpack_from(data) == (word, counts)


@pytest.mark.parametrize(
    ("pdos", "place", "problem"),
    [
        ("{status: {cob_id: 0x181}}", "cob_id: §0x181",
         "pdos.status.cob_id: found 181h, that of TPDO 1 of left.J1 too, allowed an identifier that nobody else has"),
        ("{status: {cob_id: 0x701}}", "cob_id: §0x701",
         "pdos.status.cob_id: found 1793, allowed 0x181 to 0x57F, or 0x680 to 0x6DF: CiA 301 has the others for"),
        ("{command: {number: 5}}", "number: §5", "pdos.command.number: found 5, allowed 4 or less"),
        ("{offset: {number: 2}}", "§offset: {number",
         "pdos.offset: found offset, which this axis does not have, allowed PDOs that carry something"),
        ("{command: {number: 2}}, feed_forward: velocity", "number: §2",
         "pdos.command.number: found RPDO 2 twice, allowed a number of its own"),
        ("{status: {mapping: [0x60640020, 0x60410010]}}", "§[0x60640020",
         "pdos.status.mapping: found 0x60640020, 0x60410010, allowed each of 0x60410010, 0x60640020 once, in this"),
        ("{status: {mapping: [0x60410010, 0x60640020, 0x606C0020]}}", "§[0x60410010",
         "pdos.status.mapping: found 80 bits, allowed whole bytes, up to 64 bits"),
    ],
)  # fmt: skip
def test_each_mistake_is_named_at_its_place(tmp_path: Path, pdos: str, place: str, problem: str) -> None:
    copy = copy_with(tmp_path, pdos)
    with pytest.raises(ConfigError) as caught:
        load_drives(copy.drives, "bus")
    told = [copy.shown(each) for each in caught.value.problems]
    assert len(told) == 1, told
    assert told[0].startswith(f"{copy.place(DRIVES, place)}: robots.left.axes.J2.{problem}"), told


def test_two_axes_with_one_identifier_of_their_own_are_both_told(tmp_path: Path) -> None:
    copy = copy_with(tmp_path, "{status: {cob_id: 0x6A0}}")
    copy.change(DRIVES, "{node: 3, gear: 190", "{pdos: {status: {cob_id: 0x6A0}}, node: 3, gear: 190")
    with pytest.raises(ConfigError) as caught:
        load_drives(copy.drives, "bus")
    told = [str(each) for each in caught.value.problems]
    assert ["that of TPDO 1 of left.J3" in told[0], "that of TPDO 1 of left.J2" in told[1]] == [True, True]
