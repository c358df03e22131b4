"""What Foxglove draws: each schema by its name, bodies where they are."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader

from cell.config import load_cell
from cell.geometry import quaternion
from cell.messages import Body, FramePose, ManagerState, Presence, ZoneGeometry
from cell.recording.cell_files import recorded_cell
from cell.recording.scene import Scene, _turned_up
from cell.recording.writer import Recording
from tests.unit.cell.recording.recordings import BEGIN, FAULT, JOINTS, LEFT, two_arms
from tests.unit.repository import ROOT

POSES = np.array([[[[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]], [[[1.0, 0.0, 0.0], [1.0, 0.0, 1.0]]]], np.float32)
BODY = Body(True, (0.0, 0.0, 0.0), 1.0, np.array([0.1], np.float32), POSES, np.zeros(2, np.float32))
PRESENCE = Presence("left", "b", 1, 1, None, "d", BODY, 0.0)
ZONE = ZoneGeometry("handover", 1, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), ("left",))
FRAME = FramePose("table", 1, None, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
STATE = replace(LEFT, joints=(0.0,) * 6, tcp_position_m=(1.0, 0.0, 0.0), tcp_quaternion_xyzw=(0.0, 0.0, 0.0, 1.0))


def test_each_topic_has_the_schema_that_foxglove_knows(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with Recording(path, two_arms(), BEGIN) as recording:
        for message in (STATE, PRESENCE, ZONE, FRAME, FAULT):
            recording.add(message, BEGIN)
    with path.open("rb") as file:
        found = {channel.topic: schema.name for schema, channel, _ in make_reader(file).iter_messages() if schema}
    drawn = {topic: name for topic, name in found.items() if name.startswith("foxglove.")}
    assert drawn == {
        "/joints/left": "foxglove.JointStates",
        "/tf/left": "foxglove.FrameTransforms",
        "/tf/frames": "foxglove.FrameTransforms",
        "/scene/left": "foxglove.SceneUpdate",
        "/scene/zones": "foxglove.SceneUpdate",
        "/log": "foxglove.Log",
    }


@pytest.mark.parametrize("cell", sorted(path.parent.name for path in (ROOT / "cell_configs").glob("*/cell.yaml")))
def test_every_cell_can_be_drawn(cell: str) -> None:
    settings = load_cell(ROOT / "cell_configs" / cell / "cell.yaml")
    scene = Scene(recorded_cell(settings, JOINTS))
    topics = [topic for topic, picture in scene.begin(BEGIN) if picture.encode()]
    assert ("/scene/things" in topics) == any(robot.things for robot in settings.robots.values())
    assert ("/tf/frames" in topics) == bool(settings.frames)


def test_a_body_is_drawn_ten_times_a_second_at_most_and_unknown_ones_as_their_reach() -> None:
    scene = Scene(two_arms())
    drawn = [at for at in np.arange(0.0, 1.0, 0.02) if list(scene.of(PRESENCE, BEGIN + at))]
    assert len(drawn) == 10
    unknown = replace(PRESENCE, body=Body(False, (0.0, 0.0, 0.0), 1.0))
    assert [topic for topic, _ in scene.of(unknown, BEGIN + 2.0)] == ["/scene/left"]


def test_zones_are_drawn_anew_when_their_state_changes() -> None:
    scene = Scene(two_arms())
    assert [topic for topic, _ in scene.of(ZONE, BEGIN)] == ["/scene/zones"]
    assert list(scene.of(ManagerState("c", "m", 1, 1, 0.0, "d"), BEGIN)) == []


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 1e-3))
def test_a_column_stands_along_its_capsule(way: tuple[float, float, float]) -> None:
    along = np.array(way) / np.linalg.norm(way)
    turn = quaternion.to_matrix(np.array(_turned_up(along)))
    np.testing.assert_allclose(turn @ [0.0, 0.0, 1.0], along, atol=1e-6)


@pytest.mark.parametrize("along", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0)])
def test_also_along_the_axes(along: tuple[float, float, float]) -> None:
    turn = quaternion.to_matrix(np.array(_turned_up(np.array(along))))
    np.testing.assert_allclose(turn @ [0.0, 0.0, 1.0], along, atol=1e-12)
