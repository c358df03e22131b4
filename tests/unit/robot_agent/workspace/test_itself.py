"""Where the links of one robot come too near to each other, against a fine look that shares nothing with it."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cell.geometry import segment_distance, transform_points
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import PlanFailed, Planned, PlanRequest
from robot_agent.kinematics import Model, load_model, model_of
from robot_agent.language import JointStep
from robot_agent.model import TOOL, Apart, CapsuleBody, RobotDescription, Tool
from robot_agent.model.description import Capsule, Mounted
from robot_agent.paths import JointMove, Sequence
from robot_agent.trajectory import Limits, Motion, plan
from robot_agent.workspace import Itself, PlacedRobot, Things, Touch, owned_by, sweep
from tests.unit.jog_world import Jogged
from tests.unit.repository import ROOT

MODELS = ROOT / "cell_configs" / "models"
ARM = load_model(MODELS / "six_axis.yaml")
FOLDED = np.radians([0.0, -90.0, 75.0, 0.0, 100.0, 0.0])
"""The hand deep in carousel and upper arm."""
FINE_S = 2e-4


def changed(**changes: object) -> Model:
    return model_of(replace(ARM.description, **changes))  # type: ignore[arg-type]


def hook(length_m: float) -> Tool:
    """A tool that reaches back beside the wrist."""
    return Tool(
        "hook", np.eye(4), 0.0, (0.0, 0.0, 0.0), np.zeros((3, 3)),
        (Capsule((0.1, 0.0, 0.0), (0.1, 0.3, 0.0), 0.02), Capsule((0.1, 0.3, 0.0), (0.1 - length_m, 0.3, 0.0), 0.02)),
    )  # fmt: skip


def names(model: Model) -> set[tuple[str, str]]:
    return set(Itself(model).parts())


def gaps(model: Model, q: np.ndarray) -> np.ndarray:
    """The least distance of two parts that are to keep apart `(m,)`, at joints `(m, n)`."""
    ends, (one, other), radii = model.capsules(q), Itself(model).pairs, model.capsule_radii
    return np.asarray((segment_distance(ends[:, one], ends[:, other]) - radii[one] - radii[other]).min(axis=-1))


def moved(model: Model, start: np.ndarray, target: np.ndarray) -> Motion:
    return plan(model, Sequence([JointMove(target, 1.0, 1)]), Limits.of(model.description), start=start)


def first_touch(model: Model, motion: Motion, base: np.ndarray | None = None) -> Touch | None:
    pose = np.eye(4) if base is None else base
    body = sweep(model, pose, motion.q(motion.grid))
    return Things(model).first_touch(
        body, motion.grid, lambda taus: transform_points(pose, model.capsules(motion.q(taus)))
    )


def test_pairs_that_meet_in_some_poses_only_are_kept_apart() -> None:
    found = names(ARM)
    assert ("1", "flange") in found
    assert ("2", "flange") in found
    assert ("1", "2") not in found  # a joint holds them together
    assert ("4", "flange") not in found  # in each other in every pose
    assert len(found) == len(Itself(ARM).pairs.T) == 14


@pytest.mark.parametrize("file", sorted(MODELS.glob("*.yaml")), ids=lambda file: file.stem)
def test_no_shipped_robot_is_too_near_to_itself_at_home(file: object) -> None:
    model = load_model(file)  # type: ignore[arg-type]
    itself = Itself(model)
    assert itself.pairs.size
    clear = itself.clearance(model.capsules(model.home)[None], model.capsule_radii, np.inf)
    assert clear.min() >= 0.0
    everywhere = {tuple(sorted(pair)) for pair in combinations(range(len(model.body)), 2)}
    assert {tuple(sorted(pair)) for pair in itself.pairs.T.tolist()} <= everywhere


@given(start=st.tuples(*[st.floats(0.0, 1.0)] * 6), target=st.tuples(*[st.floats(0.0, 1.0)] * 6))
@settings(max_examples=12, deadline=None)
def test_no_touch_of_itself_is_missed_and_no_free_motion_refused(
    start: tuple[float, ...], target: tuple[float, ...]
) -> None:
    lower, upper = ARM.limits.position.T
    motion = moved(ARM, *(lower + np.array(share) * (upper - lower) for share in (start, target)))
    taus = np.arange(0.0, motion.duration_s + FINE_S, FINE_S)
    clear, touch = gaps(ARM, motion.q(taus)), first_touch(ARM, motion)
    if clear.min() < 0.0:
        assert touch is not None
        assert touch.tau <= taus[np.argmax(clear < 0.0)] + FINE_S
    if touch is not None:
        assert clear[np.abs(taus - touch.tau) < 0.005].min() < 1e-3


def test_what_comes_too_near_to_what_is_told_with_how_much() -> None:
    motion = moved(ARM, ARM.home, FOLDED)
    touch = first_touch(ARM, motion)
    assert touch is not None
    assert str(touch).startswith("link flange comes ")
    assert str(touch).endswith(" mm too near to link 1 (margin 0 mm)")


@pytest.mark.parametrize("margin_mm", [0.0, 1.0, 40.0])
def test_the_margin_is_kept_to_a_quarter_of_a_millimetre(margin_mm: float) -> None:
    model = changed(apart=Apart(margin_mm / 1000.0))
    motion = moved(model, model.home, FOLDED)
    touch = first_touch(model, motion)
    assert touch is not None
    before = gaps(ARM, motion.q(np.linspace(0.0, touch.tau, 200)))
    assert before.min() >= margin_mm / 1000.0 - 1e-6
    assert gaps(ARM, motion.q(np.array([touch.tau + 0.002]))).min() < margin_mm / 1000.0 + 0.004


@example(start=(0.5,) * 6, target=(0.5,) * 6)
@given(start=st.tuples(*[st.floats(0.3, 0.7)] * 6), target=st.tuples(*[st.floats(0.3, 0.7)] * 6))
@settings(max_examples=8, deadline=None)
def test_a_fast_motion_that_stays_half_a_millimetre_beyond_the_margin_is_free(
    start: tuple[float, ...], target: tuple[float, ...]
) -> None:
    lower, upper = ARM.limits.position.T
    motion = moved(ARM, *(lower + np.array(share) * (upper - lower) for share in (start, target)))
    wide = (("3", "5"),)  # whose distance hardly changes
    taus = np.arange(0.0, motion.duration_s + FINE_S, FINE_S)
    least = float(gaps(changed(apart=Apart(0.0, wide)), motion.q(taus)).min())
    if least > 0.001:
        assert first_touch(changed(apart=Apart(least - 0.0005, wide)), motion) is None
        nearer = changed(apart=Apart(least + 0.0001, wide))  # a pair that is as near in all poses is none any more
        kept_m = float(gaps(nearer, motion.q(taus)).min())
        assert (first_touch(nearer, motion) is not None) is (kept_m < least + 0.0001)


def test_it_does_not_matter_where_the_robot_stands() -> None:
    base = np.eye(4)
    base[:3, :3], base[:3, 3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]], [3.0, -2.0, 0.5]
    motion = moved(ARM, ARM.home, FOLDED)
    here, there = first_touch(ARM, motion), first_touch(ARM, motion, base)
    assert here is not None
    assert there is not None
    assert there.tau == pytest.approx(here.tau, abs=1e-3)


def test_both_links_may_move_between_two_samples() -> None:
    """Samples far apart on both sides of a contact: neither of the two links would reach the other alone."""
    arm, hand = (CapsuleBody(link, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.05) for link in (3, 6))
    model = changed(capsules=(arm, hand))
    itself = Itself(model)
    points = np.zeros((2, 2, 2, 3))
    points[:, 0, :, 0], points[:, 1, :, 0] = [[-0.10], [-0.01]], [[0.10], [0.01]]
    ways = np.linalg.norm(np.diff(points, axis=0), axis=-1).max(axis=-1)
    np.testing.assert_allclose(itself.way(ways), [[0.18]])
    np.testing.assert_allclose(itself.clearance(points, model.capsule_radii, np.inf), [[0.10], [-0.08]])
    assert itself.bodies == 2


def test_what_may_touch_is_not_kept_apart() -> None:
    free = tuple((part, other) for part in ("1", "2", "base") for other in ("4", "5", "flange"))
    model = changed(apart=Apart(0.0, free))
    assert names(ARM) - names(model) == set(free) & names(ARM)
    assert first_touch(model, moved(model, model.home, FOLDED)) is None


def test_a_tool_keeps_away_from_the_link_before_the_flange_too() -> None:
    model = changed(tools={"hook": hook(0.6)}, mounted=Mounted(("hook",)))
    assert ("5", "tool") in names(model)
    assert ("3", "tool") in names(model)
    assert ("5", "flange") not in names(model)
    touch = first_touch(model, moved(model, model.home, model.home - np.radians([0, 0, 0, 0, 0, 90])))
    assert touch is not None
    assert str(touch).startswith("the tool comes ")


def planned(model: Model, *targets: np.ndarray) -> Planned | PlanFailed:
    steps = tuple(JointStep(line, tuple(q.tolist()), 1.0) for line, q in enumerate(targets, start=7))
    return Planner(PlacedRobot.at(model), 0.004).plan(PlanRequest(1, steps, model.home, ()))


def test_a_program_that_leads_into_itself_is_refused_with_its_line() -> None:
    failed = planned(ARM, ARM.home + 0.1, FOLDED)
    assert isinstance(failed, PlanFailed)
    assert failed.line == 8
    assert "too near to link 1 (margin 0 mm)" in failed.text
    assert isinstance(planned(ARM, ARM.home + 0.1), Planned)


def test_a_jog_stands_in_front_of_its_own_arm_and_comes_out_again() -> None:
    things = Things(ARM)
    jogged = Jogged(FOLDED - np.radians([0, 0, 30, 0, 0, 0]), ARM, Limits.of(ARM.description))

    def clear(states: object) -> str:
        return things.in_the_way(sweep(ARM, np.eye(4), states.q))  # type: ignore[attr-defined]

    assert gaps(ARM, jogged.q[None])[0] > 0.0
    jogged.run(key := jogged.press(2, 0.5, clear=clear), 150)
    assert "link 1 is in the way of link flange" in key.ruled_by
    stood = gaps(ARM, np.array(jogged.played))
    assert stood.min() > 0.0
    assert stood[-1] < 0.03
    for speed, way_out in ((-0.5, True), (0.5, False)):
        inside = Jogged(FOLDED - np.radians([0, 0, 10, 0, 0, 0]), ARM, Limits.of(ARM.description))
        inside.run(inside.press(2, speed, clear=clear), 20)
        assert (abs(inside.q[2] - inside.played[0][2]) > 0.05) == way_out


def test_the_same_pairs_are_found_every_time() -> None:
    description: RobotDescription = ARM.description
    assert (Itself(model_of(description)).pairs == Itself(ARM).pairs).all()


@pytest.mark.parametrize(
    ("part", "said"),
    [("base", "base"), ("upper_arm", "upper arm"), ("4", "link 4"), (TOOL, "tool"), ("wrist_1", "wrist 1")],
)
def test_a_part_after_the_name_of_its_robot_reads_as_people_say_it(part: str, said: str) -> None:
    assert owned_by(part) == said
