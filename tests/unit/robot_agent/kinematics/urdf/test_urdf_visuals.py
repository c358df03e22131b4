"""Where the links of a URDF are seen, against Pinocchio's own reading of the same file."""

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from cell.config.settings import BoxShape, CylinderShape, MeshShape, SphereShape
from robot_agent.kinematics import BadModel, load_model
from robot_agent.kinematics.urdf.urdf_visuals import urdf_visuals
from robot_agent.model.description import UrdfSource
from tests.unit.ball_mesh import ball_file
from tests.unit.config_world import Copy
from tests.unit.robot_agent.kinematics.urdf.painter_visuals import ORIGINS, arm


def test_each_is_where_pinocchio_sees_it(tmp_path: Path) -> None:
    ball_file(tmp_path).rename(tmp_path / "ball.obj")
    copy = Copy(tmp_path)
    file = arm(tmp_path)
    (copy.folder / "models" / "painter.urdf").write_text(file.read_text())
    model = load_model(copy.folder / "models" / "painter.yaml")
    visuals = urdf_visuals(UrdfSource(file, "flange"))
    peer = pin.buildModelFromUrdf(str(file))
    seen = pin.buildGeomFromUrdf(peer, str(file), pin.GeometryType.VISUAL, package_dirs=str(tmp_path))
    data, placed = peer.createData(), seen.createData()
    links = [name for name in file_order(file) if name in ORIGINS]
    assert len(visuals) == seen.ngeoms == len(ORIGINS)
    rng = np.random.default_rng(1)
    for _ in range(50):
        joints = rng.uniform(*model.limits.position.T)
        q = pin.neutral(peer)
        for number, value in enumerate(joints, start=1):
            q[peer.joints[peer.getJointId(f"axis_{number}")].idx_q] = value
        pin.updateGeometryPlacements(peer, data, seen, placed, q)
        poses = model.links(joints)[[each.link for each in visuals]] @ [each.pose_link_visual for each in visuals]
        for link, pose in zip(links, poses, strict=True):
            expected = placed.oMg[seen.getGeometryId(f"{link}_0")].homogeneous
            np.testing.assert_allclose(pose, expected, atol=1e-9, err_msg=link)
    assert visuals[0].scale == tuple(seen.geometryObjects[0].meshScale) == (0.001, 0.002, -0.001)


def file_order(file: Path) -> list[str]:
    return [part.split('"')[0] for part in file.read_text().split('<link name="')[1:]]


@pytest.mark.parametrize(
    ("geometry", "shape"),
    [
        ('<box size="0.1 0.2 0.3"/>', BoxShape((0.1, 0.2, 0.3))),
        ('<cylinder radius="0.1" length="0.4"/>', CylinderShape(0.1, 0.4)),
        ('<sphere radius="0.1"/>', SphereShape(0.1)),
    ],
)
def test_simple_solids_are_seen_too(tmp_path: Path, geometry: str, shape: object) -> None:
    assert urdf_visuals(UrdfSource(arm(tmp_path, geometry), "flange"))[0].shape == shape


@pytest.mark.parametrize(
    "name", ["meshes/ball.obj", "package://arm/meshes/ball.obj", "file://{folder}/arm/meshes/ball.obj"]
)
def test_a_file_is_found_beside_the_urdf_in_its_package_and_by_its_whole_path(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "arm"
    (folder / "meshes").mkdir(parents=True)
    ball = ball_file(tmp_path).rename(folder / "meshes" / "ball.obj")
    file = arm(folder, f'<mesh filename="{name.format(folder=tmp_path)}"/>')
    shape = urdf_visuals(UrdfSource(file, "flange"))[0].shape
    assert isinstance(shape, MeshShape)
    assert shape.file.samefile(ball)


@pytest.mark.parametrize(
    ("geometry", "problem"),
    [
        ("", "link base has a visual that is none: geometry nothing, allowed mesh, box, cylinder or sphere"),
        ("<capsule/>", "geometry capsule, allowed mesh"),
        ("<mesh/>", "no filename"),
        ('<mesh filename="a.stl" scale="1 2"/>', "scale '1 2', allowed three numbers"),
        ('<sphere radius="-1"/>', "radius '-1', allowed a number above 0"),
        ('<sphere radius="big"/>', "big"),
    ],
)
def test_a_visual_that_is_none_is_named_with_its_link(tmp_path: Path, geometry: str, problem: str) -> None:
    with pytest.raises(BadModel) as raised:
        urdf_visuals(UrdfSource(arm(tmp_path, geometry), "flange"))
    assert problem in str(raised.value)
