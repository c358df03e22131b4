"""Robots whose URDF names meshes are drawn by them, all others by their capsules."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("viser", reason="the group `view` is not installed")

import trimesh

from cell.commands.client.page_server import meshes_of
from cell.config.settings import CellSettings
from cell.core import Arrived
from cell.view.gate import Gate, Level
from cell.view.newest import Newest
from cell.view.server import GatedServer, listen
from cell.view.stage import ALARM, ROBOT_COLOURS, Stage
from robot_agent.kinematics import load_model
from tests.unit.ball_mesh import ball_file
from tests.unit.cell.view.room import CELL, presence, robot
from tests.unit.config_world import Copy
from tests.unit.robot_agent.kinematics.urdf.painter_visuals import ORIGINS, arm

JOINTS = (0.1, -0.2, 0.3, 0.4, -0.5, 0.6)


def painters(folder: Path, geometry: str = '<mesh filename="ball.obj" scale="0.001 0.001 0.001"/>') -> CellSettings:
    """The room's cell, `left` a painter whose links are balls; its base is 1 m to the side."""
    models = Copy(folder).folder / "models"
    ball_file(models).rename(models / "ball.obj")
    arm(models, geometry)
    left = CELL.robots["left"]
    base = replace(left.base, position_m=(1.0, 0.0, 0.0), quaternion_xyzw=(0.0, 0.0, 0.0, 1.0))
    return replace(CELL, robots={**CELL.robots, "left": replace(left, model=models / "painter.yaml", base=base)})


def test_links_without_a_mesh_stay_capsules(tmp_path: Path) -> None:
    settings = painters(tmp_path)
    urdf = settings.robots["left"].model.with_suffix(".urdf")
    text = urdf.read_text()
    upper_arm = text.index('<link name="upper_arm">')
    begin, end = text.index("<visual>", upper_arm), text.index("</visual>", upper_arm) + len("</visual>")
    urdf.write_text(text[:begin] + text[end:])
    capsules = load_model(settings.robots["left"].model).description.capsules
    # The upper arm is link 2; wrist_1, link 4, has no visual either.
    stay = {i for i, capsule in enumerate(capsules) if capsule.link in (2, 4)}
    assert stay
    replaced = meshes_of(settings, settings.robots)["left"].replaced
    assert set(replaced) == set(range(len(capsules))) - stay


def test_each_link_is_a_mesh_at_its_place_in_world(tmp_path: Path) -> None:
    settings = painters(tmp_path)
    meshes = meshes_of(settings, settings.robots)
    assert list(meshes) == ["left"]
    model = load_model(settings.robots["left"].model)
    left = meshes["left"]
    assert (left.joints, len(left.links)) == (6, len(ORIGINS))
    radii = np.linalg.norm(left.links[0].vertices, axis=-1)
    np.testing.assert_allclose(radii, 0.1, atol=1e-6)
    carousel = model.links(np.array(JOINTS))[1]
    np.testing.assert_allclose(left.place(np.array(JOINTS))[1][:3, 3], carousel[:3, 3] + [1.0, 0.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("kind", ["stl", "ply", "glb"])
def test_other_kinds_of_files_are_the_same_mesh(tmp_path: Path, kind: str) -> None:
    settings = painters(tmp_path, f'<mesh filename="ball.{kind}" scale="0.001 0.001 0.001"/>')
    ball = settings.robots["left"].model.parent / "ball.obj"
    trimesh.load_mesh(ball).export(ball.with_suffix(f".{kind}"))
    link = meshes_of(settings, settings.robots)["left"].links[0]
    np.testing.assert_allclose(np.linalg.norm(link.vertices, axis=-1), 0.1, atol=1e-5)


@pytest.mark.parametrize(
    ("geometry", "told"),
    [
        ('<mesh filename="lost.stl"/>', "which the URDF names; put it there, or correct its filename"),
        ('<mesh filename="painter.yaml"/>', "cannot be read as a mesh"),
        ('<mesh filename="broken.stl"/>', "cannot be read as a mesh"),
        ('<mesh filename="broken.obj"/>', "cannot be read as a mesh"),
        ('<mesh filename="broken.dae"/>', "cannot be read as a mesh"),
    ],
)
def test_a_mesh_that_is_missing_or_broken_is_one_sentence_and_the_capsules_stay(
    tmp_path: Path, geometry: str, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    settings = painters(tmp_path, geometry)
    for name in ("broken.stl", "broken.obj", "broken.dae"):
        (settings.robots["left"].model.parent / name).write_bytes(b"solid nothing\n\x00\xff")
    assert meshes_of(settings, settings.robots) == {}
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    assert said[0].startswith("the meshes of left are not shown, but its capsules: ")
    assert told in said[0]


def test_a_urdf_without_meshes_is_drawn_by_its_capsules(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings = painters(tmp_path, '<box size="1 1 1"/>')
    assert meshes_of(settings, settings.robots) == {}
    assert capsys.readouterr().err == ""


def test_the_page_moves_the_meshes_with_the_measured_joints_and_hides_them_where_nobody_knows_them(
    tmp_path: Path,
) -> None:
    settings = painters(tmp_path)
    meshes = meshes_of(settings, settings.robots)
    server = GatedServer(Gate(("127.0.0.1",), Level.WATCH), listen("127.0.0.1", 0))
    try:
        stage, seen = Stage(server, settings, meshes), Newest()
        drawn = stage._robots["left"]
        assert drawn.meshes is not None
        assert stage._robots["right"].meshes is None

        def picture(*messages: object) -> None:
            seen.look([Arrived(message, 0.0) for message in messages], 0.0)
            stage.often(seen)

        state = replace(robot("left"), joints=JOINTS)
        picture(presence("left", 0.0), state)
        links = drawn.meshes._links
        expected = meshes["left"].place(np.array(JOINTS))
        np.testing.assert_allclose([link.position for link in links], expected[:, :3, 3], atol=1e-6)
        assert all(link.visible for link in links)
        # The capsules of the links are not drawn beside them, those of the other robot are.
        assert drawn.now._shown is None
        assert stage._robots["left"].meshes._colour == ROBOT_COLOURS[0]
        picture(replace(state, sequence=state.sequence + 1, joints=None))
        assert not any(link.visible for link in links)
        assert drawn.now._shown is not None
        # A silent robot stays where it was, in red.
        picture(replace(state, sequence=state.sequence + 2))
        seen.look([], 1000.0)
        stage.often(seen)
        assert all(link.visible for link in links)
        assert drawn.meshes._colour == ALARM
    finally:
        server.stop()
