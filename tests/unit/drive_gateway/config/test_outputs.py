"""Digital outputs in a drives file: what becomes of them, and drives that cannot have them."""

import re
from pathlib import Path

import pytest

from cell.config import ConfigError
from drive_gateway.canopen.axes_eds import eds_text
from drive_gateway.canopen.pdo_map import process_image
from drive_gateway.config import load_drives
from drive_gateway.config.image import image_of
from drive_gateway.config.settings import OutputSettings
from tests.unit.config_world import CONFIGS, DRIVES, Copy

GRIPPER = "gripper: {axis: J6, bit: 16, at_stop: keep}"
GANTRY = "festo_gantry/drives.yaml"


def problems(copy: Copy, file: str = DRIVES) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        load_drives(copy.folder / file, "bus")
    return [copy.shown(problem) for problem in caught.value.problems]


def test_the_shipped_gripper_is_an_output_of_the_last_axis_alone() -> None:
    left = load_drives(CONFIGS / DRIVES, "left_bus").robots["left"]
    assert left.outputs == (OutputSettings("gripper", "J6", 16, 0.0, keep=True),)
    assert [axis.output_mask for axis in left.axes] == [0, 0, 0, 0, 0, 1 << 16]
    assert [image_of(axis).outputs is not None for axis in left.axes] == [False] * 5 + [True]


def test_outputs_keep_the_order_of_the_file_and_share_the_word_of_their_drive(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(
        DRIVES, GRIPPER, f"{GRIPPER}\n      laser: {{axis: J6, bit: 0, lead_s: 0.01, at_stop: off}}"
    )
    left = load_drives(copy.drives, "left_bus").robots["left"]
    assert left.outputs[1] == OutputSettings("laser", "J6", 0, 0.01)
    assert left.axes[5].output_mask == 0x10001


def test_the_second_axis_of_a_node_has_its_own_object_and_pdo() -> None:
    outputs = process_image(5, axis=2, outputs=True).outputs
    assert outputs is not None
    assert (outputs.cob_id, outputs.entries) == (0x406, (0x68FE0120,))
    assert [(write.index, write.sub) for write in outputs.writes()][:2] == [(0x1442, 1), (0x1442, 2)]


@pytest.mark.parametrize(
    ("section", "lacking"), [(r"60FE(sub\d)?", "60FE:01 and 60FE:02"), (r"1[46]02(sub\d)?", "1402:01 and 1602:01")]
)
def test_a_drive_whose_eds_lacks_the_objects_is_named_with_them(tmp_path: Path, section: str, lacking: str) -> None:
    text = re.sub(rf"\[{section}\]\n([^\[]+\n)*", "", eds_text())
    text = re.sub(
        r"(\d+)=0x(60FE|1402|1602)\n",
        lambda found: found[0] if found[2] not in lacking else f"{found[1]}=0x6041\n",
        text,
    )
    copy = Copy(tmp_path).change(DRIVES, "gear: 80,", "gear: 80, eds: drive.eds,")
    (copy.drives.parent / "drive.eds").write_text(text)
    found = f"robots.left.axes.J6.eds: found drive.eds without {lacking}, which outputs of this axis need"
    assert any(found in line for line in problems(copy))


def test_a_dcf_says_the_outputs_only_where_the_file_names_none(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    copy.change(DRIVES, "gear: 80,", "gear: 80, eds: drive.dcf,").change(
        DRIVES, "gear: 180,", "gear: 180, eds: drive.dcf,"
    )
    dcf = eds_text().replace("[60FEsub1]\n", "[60FEsub1]\nParameterValue=0x10000\n")
    (copy.drives.parent / "drive.dcf").write_text(dcf)
    axes = load_drives(copy.drives, "left_bus").robots["left"].axes
    assert [[(item.index, item.sub) for item in axes[place].objects] for place in (0, 5)] == [[(0x60FE, 1)], []]


def test_profile_pdos_that_take_the_third_rpdo_leave_none_for_outputs(tmp_path: Path) -> None:
    text = (CONFIGS / GANTRY).read_text()
    robot = re.search(r"robots:\n  (\w+):\n    axes:", text)
    axis = re.search(r"    axes:\n      (\w+):", text)
    assert robot is not None
    assert axis is not None
    outputs = f"    outputs: {{light: {{axis: {axis[1]}, bit: 0, at_stop: off}}}}\n    axes:"
    copy = Copy(tmp_path).change(GANTRY, "    axes:", outputs)
    found = f"robots.{robot[1]}.axes.{axis[1]}: found outputs, whose RPDO profile_pdos.rpdo3 takes"
    assert any(found in line for line in problems(copy, GANTRY))
