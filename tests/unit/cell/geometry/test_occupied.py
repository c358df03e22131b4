from cell.geometry import Box, body_touches_box
from cell.messages import Body
from tests.unit.plain_body import Capsule, plain_body

BOX = Box.at((1.0, 1.0, 1.0), (2.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
FAR = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
NEAR = (1.39, 0.0, 0.0, 1.39, 0.0, 0.3)


def body(*poses: Capsule, growth: float = 0.0) -> Body:
    return plain_body((0.1,), tuple((pose,) for pose in poses), tuple(growth for _ in poses), reach_m=5.0)


def test_a_body_clear_of_the_box_does_not_touch_it() -> None:
    assert not body_touches_box(body(FAR, NEAR), BOX)


def test_one_pose_on_the_way_is_enough() -> None:
    assert body_touches_box(body(FAR, (1.45, 0.0, 0.0, 1.45, 0.0, 0.3), FAR), BOX)


def test_the_growth_of_a_pose_counts() -> None:
    assert body_touches_box(body(FAR, NEAR, growth=0.02), BOX)


def test_an_unknown_body_counts_as_its_whole_reach() -> None:
    assert body_touches_box(Body(known=False, base=(0.0, 0.0, 0.0), reach_m=1.5), BOX)
    assert not body_touches_box(Body(known=False, base=(0.0, 0.0, 0.0), reach_m=1.49), BOX)


def test_a_body_without_poses_counts_as_its_whole_reach() -> None:
    assert body_touches_box(body(), BOX)
