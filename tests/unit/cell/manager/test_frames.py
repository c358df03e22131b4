"""Frames as the manager tells them, and moves them: the cell file first, then the running cell."""

from dataclasses import replace

import pytest

from cell.config.settings import CellSettings, FrameSettings, PoseSettings
from cell.manager import frames
from cell.manager.frames import FrameNotWritten, FramesWritten
from cell.messages import FramePose, Heard, PlaceFrame, TeachFrame
from tests.unit.manager_world import HERE, World, settings

UP = PoseSettings((0.0, 0.0, 0.1), (0.0, 0.0, 0.0, 1.0))
FRAMES = {
    "table": FrameSettings("table", None, HERE),
    "nest": FrameSettings("nest", "table", HERE),
    "line": FrameSettings("line", None, HERE, ("zone middle",)),
}
PLACE = PlaceFrame("table", UP.position_m, UP.quaternion_xyzw, "me")


def with_frames() -> CellSettings:
    return replace(settings(), frames=FRAMES)


@pytest.fixture
def world() -> World:
    return World(with_frames()).run()


def newest(world: World) -> dict[str, FramePose]:
    return {frame.frame: frame for frame in world.frames}


def moved(*names: str) -> FramesWritten:
    return FramesWritten(FRAMES | {name: replace(FRAMES[name], pose=UP) for name in names})


def place(world: World, *names: str) -> str:
    """Give the order, and let the file be written so that these frames move."""
    request = world.ask(PLACE)
    world.run()
    world.manager.receive(moved(*names), world.now)
    world.run()
    return world.replies[request].text


def test_each_frame_is_told_again_and_again_with_the_version_that_the_state_names(world: World) -> None:
    world.run(2.5)
    assert [frame.frame for frame in world.frames].count("nest") == 3
    assert world.state.frames == {name: frame.version for name, frame in newest(world).items()}
    assert newest(world)["nest"].parent == "table"


def test_a_frame_that_moves_is_told_at_once_under_a_greater_version_with_those_that_lie_in_it(world: World) -> None:
    before = newest(world)
    text = place(world, "table", "nest")
    after = newest(world)
    assert text == "frame table moves by 100.0 mm and 0.00 deg, and with it nest"
    assert after["table"].position_m == after["nest"].position_m == UP.position_m
    assert after["table"].version == after["nest"].version > before["nest"].version
    assert after["line"] == before["line"]
    assert world.state.frames["table"] == after["table"].version
    assert world.events[-1].code == "frame_moved"


def test_the_file_is_written_first_and_nothing_moves_where_that_fails(world: World) -> None:
    before = newest(world)
    request = world.ask(PLACE)
    world.run()
    (write,) = world.writes
    assert (write.frame, write.place, write.running) == ("table", UP, FRAMES)
    assert request not in world.replies
    world.manager.receive(FrameNotWritten("disk full"), world.now)
    world.run(2.0)
    assert (world.replies[request].ok, world.replies[request].text) == (False, "disk full")
    assert newest(world) == before


def test_points_are_handed_on_as_they_were_measured(world: World) -> None:
    points = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    world.call(TeachFrame("wall", points, "me"))
    world.ask(TeachFrame("table", points, "me", origin_m=(0.0, 0.0, 9.0)))
    world.run()
    assert world.writes[0].place == (*points, (0.0, 0.0, 9.0))


@pytest.mark.parametrize(
    ("frame", "says"),
    [
        ("wall", "no frame 'wall'; this cell has table, nest, line"),
        ("line", "frame line does not move while the cell runs: in it is zone middle, which every process takes"),
    ],
)
def test_a_frame_in_which_something_must_not_move_stays_where_it_is(world: World, frame: str, says: str) -> None:
    reply = world.call(replace(PLACE, frame=frame))
    assert not reply.ok
    assert says in reply.text
    assert world.writes == []


def test_one_frame_is_moved_at_a_time(world: World) -> None:
    world.ask(PLACE)
    reply = world.call(replace(PLACE, frame="nest"))
    assert (reply.ok, "frame table is being moved" in reply.text) == (False, True)
    world.manager.receive(FrameNotWritten("disk full"), world.now)
    world.ask(PLACE)
    world.run()
    assert len(world.writes) == 2


def test_an_order_that_answers_an_old_state_moves_nothing(world: World) -> None:
    old = Heard(world.state.boot, world.state.sequence)
    world.run(1.0)
    reply = world.call(PLACE, old)
    assert (reply.ok, "too old" in reply.text, world.writes) == (False, True, [])


def test_versions_grow_over_a_restart_of_the_manager_however_many_frames_were_moved(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(frames, "EDITS_PER_EPOCH", 20)
    world = World(with_frames(), epoch=7).run()
    seen = newest(world)["table"].version
    for edit in range(19):
        place(world, *(("table",) if edit % 2 == 0 else ()))
        assert world.state.frames["table"] > seen
        seen = world.state.frames["table"]
    reply = world.call(PLACE)
    assert (reply.ok, "start it again" in reply.text) == (False, True)
    world.restart_manager(epoch=8, boot="m2")
    world.run()
    assert world.state.frames["table"] > seen
