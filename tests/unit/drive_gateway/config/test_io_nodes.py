"""I/O nodes in a drives file, and outputs and named inputs that are at one of them."""

from pathlib import Path

import pytest

from cell.config import ConfigError
from drive_gateway.canopen.pdo_map import EVERY_SYNC
from drive_gateway.config import load_drives
from drive_gateway.config.bus_load import bus_load
from drive_gateway.config.image import image_of, images_of, io_image_of
from drive_gateway.config.load import read_drives
from drive_gateway.config.settings import NamedInput, OutputSettings
from tests.unit.config_world import DRIVES, Copy

GRIPPER = "gripper: {axis: J6, bit: 16, at_stop: keep}"
COUPLER = "io_nodes: {coupler: {node: 20, input_bytes: 1, output_bytes: 2}}"
AT_IO = "gripper: {io: coupler, bit: 11, lead_s: 0.02, at_stop: keep}"
INPUT = "    inputs: {part_present: {io: coupler, bit: 7}, pressure: {axis: J6, bit: 20}}"


def copy_with(tmp_path: Path, gripper: str = AT_IO, coupler: str = COUPLER, inputs: str = INPUT) -> Copy:
    copy = Copy(tmp_path).change(DRIVES, GRIPPER, f"{gripper}\n{inputs}")
    return copy.change(DRIVES, "\nrobots:\n", f"\n{coupler}\nrobots:\n")


def problems(copy: Copy) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        load_drives(copy.drives, "bus")
    return [copy.shown(problem) for problem in caught.value.problems]


def test_an_output_and_an_input_may_be_at_an_io_node(tmp_path: Path) -> None:
    settings = load_drives(copy_with(tmp_path).drives, "bus")
    left = settings.robots["left"]
    assert left.outputs == (OutputSettings("gripper", "", 11, 0.02, keep=True, io="coupler"),)
    assert left.inputs == (NamedInput("part_present", "", 7, "coupler"), NamedInput("pressure", "J6", 20))
    (io,) = settings.io_nodes
    assert (io.name, io.node_id, io.input_bytes, io.output_bytes, io.stops) == ("coupler", 20, 1, 2, True)
    assert io.kept == 1 << 11
    image = io_image_of(io)
    assert [pdo.cob_id for pdo in image.pdos] == [0x214, 0x194]
    assert [pdo.entries for pdo in image.pdos] == [(0x62000108, 0x62000208), (0x60000108,)]
    assert image.outputs is not None
    assert image.outputs.every == EVERY_SYNC


def test_a_named_input_of_a_drive_gives_it_the_pdo_of_its_inputs(tmp_path: Path) -> None:
    axes = load_drives(copy_with(tmp_path).drives, "bus").robots["left"].axes
    assert [image_of(axis).inputs is not None for axis in axes] == [False] * 5 + [True]


def test_the_frames_of_an_io_node_count_in_the_bus_load(tmp_path: Path) -> None:
    settings = load_drives(copy_with(tmp_path).drives, "bus")
    images = images_of(settings)
    with_io, without = (
        bus_load(chosen, settings.bus.bitrate, settings.cycle_s, settings.heartbeat_producer_s).cyclic
        for chosen in (images, images[:-1])
    )
    assert with_io > without + 0.01


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"gripper": AT_IO.replace("io: coupler", "io: box")},
         "outputs.gripper.io: found 'box', allowed an I/O node of this file: coupler"),
        ({"gripper": AT_IO.replace("io: coupler", "io: coupler, axis: J6")},
         "outputs.gripper: found axis and io, allowed one of them: `axis`, an axis of this robot, or"),
        ({"gripper": AT_IO.replace("io: coupler, ", "")}, "outputs.gripper: found neither axis nor io"),
        ({"gripper": AT_IO.replace("11", "16")},
         "outputs.gripper.bit: found 16, allowed 15 or less: coupler has output_bytes: 2"),
        ({"gripper": f"{AT_IO}\n      glue: {{io: coupler, bit: 11, at_stop: off}}"},
         "outputs.glue.bit: found 11, that of gripper too, allowed each bit of 6200h of I/O node coupler once"),
        ({"inputs": INPUT.replace("bit: 7", "bit: 8")},
         "inputs.part_present.bit: found 8, allowed 7 or less: coupler has input_bytes: 1"),
        ({"inputs": INPUT.replace("bit: 20", "bit: 40")}, "inputs.pressure.bit: found 40, allowed 31 or less at"),
        ({"inputs": INPUT.replace("J6", "J7")}, "inputs.pressure.axis: found 'J7', allowed an axis of left: J1, J2"),
        ({"coupler": COUPLER.replace("input_bytes: 1, ", "")},
         "inputs.part_present.bit: found 7, allowed none: coupler has input_bytes: 0"),
        ({"coupler": COUPLER.replace("20", "3")}, "coupler.node: found 3, that of left.J3 too, allowed a Node-ID"),
        ({"coupler": COUPLER.replace("20", "127")}, "coupler.node: found 127, under which the gateway itself"),
        ({"coupler": COUPLER.replace("input_bytes: 1", "input_bytes: 9")}, "input_bytes: found 9, allowed 8 or less"),
        ({"coupler": COUPLER.replace("}}", "}, box: {node: 21}}")},
         "io_nodes.box: found an I/O node with neither input_bytes nor output_bytes, allowed one of them, or both"),
        ({"coupler": COUPLER.replace("}}", "}, box: {node: 20, input_bytes: 1}}")},
         "io_nodes.box.node: found 20, that of I/O node coupler too"),
        ({"coupler": COUPLER.replace("}}", ", emergencies: wago}}")}, "coupler.emergencies: found 'wago'"),
        ({"coupler": COUPLER.replace("}}", ", on_loss: ignore}}")}, "coupler.on_loss: found 'ignore', allowed"),
    ],
)  # fmt: skip
def test_each_mistake_is_told_at_its_place(tmp_path: Path, changes: dict[str, str], found: str) -> None:
    lines = problems(copy_with(tmp_path, **changes))
    assert any(found in line for line in lines), lines


def test_an_object_that_the_node_may_lack_is_warned_of_with_what_it_costs(tmp_path: Path) -> None:
    copy = copy_with(tmp_path, coupler=COUPLER.replace("}}", ', waive: ["6206"]}}'))
    told = [str(problem) for problem in read_drives(copy.drives).problems]
    assert any("a node that may lack 6206h (error mode of the outputs): what its outputs do" in line for line in told)
