"""Which sections come too near: against all distances in 80 bits, with a memory that must never tell."""

import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import Box
from cell.manager.separation import nearness
from cell.manager.separation.nearness import Nearness
from cell.messages.sections import Refusal, Sections
from tests.unit.cell.geometry.exact_segments import LONG, by_all_that_can_be_nearest

SAFE_M = 1e-9
"""Nothing is clear that is nearer than the margin by more."""
EXACT_M = 1e-6
"""Nothing is too near that is farther than the margin by more."""
NOBODY: frozenset[int] = frozenset()
FIRST = np.arange(1, dtype=np.uint64)


def sections(points: object, radii: object, ids: np.ndarray | None = None) -> Sections:
    points = np.asarray(points, dtype=np.float32)
    radii = np.array(np.broadcast_to(np.asarray(radii, dtype=np.float32), points.shape[:2]))
    return Sections(np.arange(len(points), dtype=np.uint64) if ids is None else ids, points, radii)


def all_distances(first: Sections, second: Sections) -> np.ndarray:
    """`(s, c, t, d)`: of each capsule of each section from each of the others."""
    shape = (*first.radii.shape, *second.radii.shape, 2, 3)
    ours = np.broadcast_to(first.points[:, :, None, None], shape).reshape(-1, 2, 3)
    theirs = np.broadcast_to(second.points[None, None], shape).reshape(-1, 2, 3)
    axes = by_all_that_can_be_nearest(ours, theirs).reshape(shape[:-2])
    return np.asarray(axes - first.radii[:, :, None, None].astype(LONG) - second.radii.astype(LONG))


def without_fixed(distances: np.ndarray, fixed: frozenset[int], other_fixed: frozenset[int]) -> np.ndarray:
    distances = distances.copy()
    for link in fixed:
        distances[:, link, :, list(other_fixed)] = np.inf
    return distances


def check(found: tuple[int, Refusal] | None, distances: np.ndarray, margin: float | np.ndarray) -> None:
    """By the distances `(s, c, t, d)` of all that counts, and the margin, or those `(c, d)` of the links."""
    spare = distances - np.asarray(margin, dtype=LONG).reshape(1, *np.shape(margin)[:1], 1, *np.shape(margin)[1:])
    least = spare.min(axis=(1, 2, 3), initial=np.inf)
    if found is None:
        assert (least >= -SAFE_M).all()
        return
    index, refusal = found
    assert (least[:index] >= -SAFE_M).all()
    assert least[index] < EXACT_M
    link, other_link = (int(name.removeprefix("link ")) for name in (refusal.link, refusal.other_link))
    assert spare[index, link, :, other_link].min() < EXACT_M
    assert refusal.distance_m == pytest.approx(float(distances[index, link, :, other_link].min()), abs=SAFE_M)
    if np.ndim(margin) == 0:
        assert refusal.distance_m == pytest.approx(float(distances[index].min()), abs=SAFE_M)


def separation(
    margin_m: float = 0.03,
    margins_m: dict[frozenset[str], float] | None = None,
    fixed: Callable[[str], frozenset[int]] = lambda _: NOBODY,
) -> Nearness:
    return Nearness(margin_m, margins_m or {}, fixed, lambda _, capsule: f"link {capsule}")


KINDS = ("plain", "round", "parallel", "points", "thin", "twice", "far out")


def ways(kind: str, rng: np.random.Generator, links: int = 5, other_links: int = 4) -> tuple[Sections, Sections]:
    """Of two robots that are in each other's way here and there."""
    drawn = []
    for count, capsules, x in ((9, links, 0.0), (12, other_links, rng.uniform(0.5, 2.0))):
        base = rng.uniform(-0.3, 0.3, (count, capsules, 1, 3))
        points = base + rng.uniform(-0.3, 0.3, (count, capsules, 2, 3)) + [x, 0, 0]
        radii = rng.uniform(0.02, 0.2, (count, capsules))
        ids = rng.integers(0, 2**64, count, dtype=np.uint64)
        match kind:
            case "round":
                points = rng.integers(-2, 3, points.shape) / 4.0 + [round(4 * x) / 4, 0, 0]
                radii = rng.integers(0, 3, radii.shape) / 16.0
            case "parallel":
                points[:, :, 1] = points[:, :, 0] + rng.integers(-2, 3, (count, capsules, 1)) * [0, 0.25, 0]
            case "points":
                points[:, ::2, 1] = points[:, ::2, 0]
            case "thin":
                radii[:, ::2] = 0.0
            case "twice":
                again = rng.integers(0, count, count)
                points, radii, ids = points[again], radii[again], ids[again]
                points[:, -1], radii[:, -1] = points[:, 0], radii[:, 0]
            case "far out":
                points += [300.0, -1000.0, 0.0]
        drawn.append(sections(points, radii, ids))
    return drawn[0], drawn[1]


@pytest.mark.parametrize("kind", KINDS)
def test_the_first_section_that_is_too_near_is_found_at_every_margin(kind: str) -> None:
    rng = np.random.default_rng(7)
    answers = set()
    for _ in range(12):
        asked, reserved = ways(kind, rng)
        distances = all_distances(asked, reserved)
        least = distances.min(axis=(1, 2, 3))
        at = np.sort(least)[rng.integers(0, len(least), 2)].astype(float).clip(min=0.0)
        for margin in (0.0, 0.0625, 0.25, *at, *(at + 1e-8), *(at - 1e-8).clip(min=0.0)):
            found = separation(margin).first_too_near("left", asked, "right", reserved)
            check(found, distances, margin)
            answers.add(found and found[0])
    assert {None, 0, 1} <= answers


def test_bodies_of_fifty_capsules_are_measured_as_exactly() -> None:
    rng = np.random.default_rng(8)
    for _ in range(4):
        asked, reserved = ways("plain", rng, 50, 8)
        distances = all_distances(asked, reserved)
        for margin in np.quantile(distances.min(axis=(1, 2, 3)).astype(float), (0.0, 0.3, 1.0)):
            check(separation(margin).first_too_near("left", asked, "right", reserved), distances, margin)


def test_capsules_that_touch_exactly_at_the_margin_are_clear_and_a_hair_nearer_are_not() -> None:
    reserved = sections([[[[0, 0, 0], [0, 0, 1]]]], 0.125)
    at = sections([[[[0.5, 0, 0], [0.5, 0, 1]]]], 0.125)
    assert separation(0.25).first_too_near("left", at, "right", reserved) is None
    nearer = sections([[[[np.nextafter(np.float32(0.5), np.float32(0)), 0, 0], [0.5, 0, 1]]]], 0.125)
    found = separation(0.25).first_too_near("left", nearer, "right", reserved)
    assert found is not None
    assert found[0] == 0


ROBOTS = {"left": 3, "right": 4, "third": 2}
LENGTH = 16
MARGINS = {frozenset(("left", "right")): 0.25, frozenset(("left", "third")): 0.0625}
MARGIN = 0.125
FIXED = frozenset({0, 2, 7})


def rolling_ways() -> dict[str, Sections]:
    """All under the same ids, so only the robot tells whose they are."""
    rng = np.random.default_rng(11)
    found = {}
    for number, (robot, links) in enumerate(ROBOTS.items()):
        middle = np.array([[0.0, 0.0, 0.0], [0.75, 0.0, 0.0], [0.25, 0.75, 0.0]][number])
        points = rng.integers(-2, 3, (LENGTH, links, 2, 3)) / 4.0 + middle
        points[:, 0] = np.array([[0, 0, 0], [0.5, 0, 0]]) + middle
        points[::3] += [0, 0, 0.875]
        found[robot] = sections(points, rng.integers(0, 4, (LENGTH, links)) / 32.0)
    return found


WAYS = rolling_ways()
DISTANCES = {
    (robot, other): all_distances(WAYS[robot], WAYS[other]) for robot in WAYS for other in WAYS if robot != other
}


@contextmanager
def little_memory() -> Iterator[None]:
    with patch.multiple(nearness, _ASKED=4, _RESERVED=5, _BOUNDED=3, _AT_ONCE=40):
        yield


def check_call(one: Nearness, pair: tuple[str, str], part: np.ndarray, other_part: np.ndarray, known: bool) -> None:
    robot, other = pair
    fixed = [frozenset(each for each in FIXED if known and each < ROBOTS[name]) for name in pair]
    distances = without_fixed(DISTANCES[pair], *fixed)[part][:, :, other_part]
    found = one.first_too_near(robot, WAYS[robot][part], other, WAYS[other][other_part])
    check(found, distances, MARGINS.get(frozenset(pair), MARGIN))


stretches = st.builds(lambda start, count: np.arange(start, start + count), st.integers(0, LENGTH), st.integers(0, 3))
parts = st.builds(lambda *both: np.concatenate(both), stretches, stretches)
"""Of a way, as when a robot changes its mind: what it keeps, and what comes then."""
rolls = st.lists(st.tuples(st.integers(-1, 2), st.integers(-1, 2)), min_size=2, max_size=8)
calls = st.lists(st.tuples(st.sampled_from(sorted(DISTANCES)), parts, parts, rolls, st.booleans()), max_size=8)


@settings(max_examples=60, deadline=None)
@given(calls)
def test_what_is_remembered_never_makes_an_answer_another_one(
    calls: list[tuple[tuple[str, str], np.ndarray, np.ndarray, list[tuple[int, int]], bool]],
) -> None:
    shape = {"known": True}
    with little_memory():
        one = separation(MARGIN, MARGINS, lambda _: FIXED if shape["known"] else NOBODY)
        for pair, part, other_part, steps, shape["known"] in calls:
            for step, other_step in [(0, 0), *steps]:
                part, other_part = ((part + step) % LENGTH, (other_part + other_step) % LENGTH)
                check_call(one, pair, part, other_part, shape["known"])


def test_a_memory_that_forgets_all_the_time_is_never_wrong() -> None:
    rng, pairs = np.random.default_rng(14), sorted(DISTANCES)
    with little_memory():
        one = separation(MARGIN, MARGINS, lambda _: NOBODY)
        for _ in range(2500):
            part, other_part = (rng.integers(0, LENGTH // 2, rng.integers(1, most + 2)) for most in (4, 5))
            check_call(one, pairs[rng.integers(len(pairs))], part, other_part, False)


def test_long_ways_that_roll_past_each_other_are_told_as_without_memory() -> None:
    rng = np.random.default_rng(12)
    left, right = (
        sections(
            np.cumsum(rng.normal(0, 0.02, (500, 1, 1, 3)), axis=0)
            + rng.uniform(-0.3, 0.3, (1, 3, 2, 3))
            + [middle, 0, 0],
            0.05,
        )
        for middle in (0.0, 0.9)
    )
    one, answers = separation(), set()
    for start in range(0, 400, 7):
        asked, reserved = left[start + 30 : start + 45], right[start : start + 40]
        found = one.first_too_near("left", asked, "right", reserved)
        assert found == separation().first_too_near("left", asked, "right", reserved)
        answers.add(found and found[0])
    assert {None, 0} < answers


@contextmanager
def measured() -> Iterator[list[int]]:
    """How many pairs of sections are looked at, each time."""
    real, counts = nearness._near, []

    def counted(first: Sections, second: Sections, within: float, fixed: nearness.Fixed) -> object:
        counts.append(len(first) * len(second))
        return real(first, second, within, fixed)

    with patch.object(nearness, "_near", counted):
        yield counts


def row(count: int, *, x: float = 0.0, z: float = 0.0) -> Sections:
    """Balls in a row along y, 10 mm apart."""
    ends = np.array([[[[x, 0.01 * k, z]] * 2] for k in range(count)])
    return sections(ends, 0.05, np.arange(count, dtype=np.uint64) + 1000)


def test_two_sections_are_measured_once() -> None:
    one, asked, reserved = separation(), row(30), row(60, x=0.1, z=0.1)
    with measured() as counts:
        assert one.first_too_near("left", asked[:20], "right", reserved[:50]) is None
        assert sum(counts) == 20 * 50
        assert one.first_too_near("left", asked[:20], "right", reserved[:50]) is None
        assert one.first_too_near("left", asked[5:15], "right", reserved[10:40]) is None
        assert sum(counts) == 20 * 50
        assert one.first_too_near("left", asked[3:22], "right", reserved[2:51]) is None
        assert sum(counts) == 22 * 51 - 3 * 1 - 2 * 2


def test_robots_far_apart_are_not_measured_at_all() -> None:
    with measured() as counts:
        assert separation().first_too_near("left", row(30), "right", row(60, x=0.14)) is None
    assert counts == []


def test_nothing_is_measured_far_behind_the_first_that_is_too_near() -> None:
    rng = np.random.default_rng(13)
    body = rng.uniform(0.0, 0.1, (1, 20, 2, 3))
    asked, reserved = sections(np.repeat(body, 40, axis=0), 0.05), sections(np.repeat(body, 100, axis=0), 0.05)
    with measured() as counts:
        found = separation().first_too_near("left", asked, "right", reserved)
    assert found is not None
    assert found[0] == 0
    assert sum(counts) <= 200


def test_only_fixed_capsules_of_both_robots_may_be_as_near_as_they_are() -> None:
    body = sections([[[[0, 0, 0], [0, 0, 0.2]], [[0, 0, 1], [0, 0, 1.2]]]], 0.1)
    beside = sections([[[[0.21, 0, 0], [0.21, 0, 0.2]], [[2, 0, 1], [2, 0, 1.2]]]], 0.1)
    assert separation(fixed=lambda _: frozenset({0})).first_too_near("left", body, "right", beside) is None
    for fixed in (NOBODY, frozenset({1})):
        found = separation(fixed=lambda _, fixed=fixed: fixed).first_too_near("left", body, "right", beside)
        assert found is not None
    half = separation(fixed=lambda robot: frozenset({0}) if robot == "left" else NOBODY)
    assert half.first_too_near("left", body, "right", beside) is not None


def test_a_shape_that_is_known_later_is_heeded_at_once() -> None:
    known: dict[str, frozenset[int]] = {}
    one = separation(fixed=lambda robot: known.get(robot, NOBODY))
    body, beside = row(1), row(1, x=0.11)
    assert one.first_too_near("left", body, "right", beside) is not None
    known.update(left=frozenset({0}), right=frozenset({0}))
    assert one.first_too_near("left", body, "right", beside) is None
    known.clear()
    assert one.first_too_near("left", body, "right", beside) is not None


@pytest.mark.parametrize(
    ("x", "text", "distance_m"),
    [
        (0.125, "left's forearm would come within 25.0 mm of where right's hand may be; 30 mm are kept", 0.025),
        (0.05, "left's forearm would come into where right's hand may be; 30 mm are kept", -0.05),
    ],
)
def test_a_refusal_says_which_links_and_how_near(x: float, text: str, distance_m: float) -> None:
    one = Nearness(0.03, {}, lambda _: NOBODY, lambda robot, _: {"left": "forearm", "right": "hand"}[robot])
    found = one.first_too_near("left", row(1), "right", row(1, x=x))
    assert found is not None
    _, refusal = found
    assert (refusal.by, refusal.link, refusal.other_link, refusal.text) == ("right", "forearm", "hand", text)
    assert refusal.distance_m == pytest.approx(distance_m, abs=1e-7)


LOST = "right does not know where it is"


def test_a_section_that_comes_again_as_another_space_is_refused() -> None:
    """An id is a hash of what a section covers, unless somebody says it who does not keep to that."""
    near = separation(fixed=lambda _: frozenset({0}))
    balls = sections([[[[0, 0, 0]] * 2] * 2], 0.1)
    assert near.first_too_near("a", balls, "b", balls) is not None
    found = near.first_too_near("a", sections([[[[0, 0, 0]] * 2]], 0.1), "b", sections([[[[0, 0, 0]] * 2]], 0.1))
    assert found == (0, Refusal("b", "a section of a or b came again as another space"))


def test_nothing_asked_and_nothing_reserved_is_clear() -> None:
    one, some = separation(), row(3)
    for asked, reserved in ((Sections(), some), (some, Sections()), (Sections(), Sections()), (some[:0], some)):
        assert one.first_too_near("left", asked, "right", reserved) is None
        assert one.first_nearer("left", asked, "right", reserved, some) is None
    assert one.first_in_reach("left", Sections(), "right", (0.0, 0.0, 0.0), 1.0, LOST) is None
    assert one.first_at_box("left", some[:0], "right", Box(np.ones(3), np.eye(4))) is None


@pytest.mark.parametrize("kind", KINDS)
def test_robots_that_are_too_near_may_part_and_never_approach(kind: str) -> None:
    rng = np.random.default_rng(9)
    answers = set()
    for _ in range(12):
        asked, reserved = ways(kind, rng)
        present = asked[rng.permutation(len(asked))[: rng.integers(0, 4)]]
        margin = rng.integers(0, 5) / 8.0
        distances, here = all_distances(asked, reserved), all_distances(present, reserved)
        kept = np.minimum(here.min(axis=(0, 2), initial=np.inf) - EXACT_M, margin)
        found = separation(margin).first_nearer("left", asked, "right", reserved, present)
        check(found, distances, kept)
        with little_memory():
            assert separation(margin).first_nearer("left", asked, "right", reserved, present) == found
        answers.add(found and found[0])
        assert separation(margin).first_nearer("left", present, "right", reserved, present) is None
    assert len(answers) > 2


def test_long_ways_at_one_place_are_measured_in_little_memory() -> None:
    rng = np.random.default_rng(7)
    asked, present, reserved = (sections(rng.normal(0.0, 0.05, (n, 8, 2, 3)), 0.1) for n in (1, 200, 200))
    tracemalloc.start()
    separation().first_nearer("a", asked, "b", reserved, present)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 100e6


def test_each_pair_of_links_keeps_its_own_distance() -> None:
    reserved = row(1)

    def body(near: float, far: float) -> Sections:
        return sections([[[[near, 0, 0]] * 2, [[-far, 0, 0]] * 2]], 0.05)

    present, one = body(0.11, 0.14), separation()
    assert one.first_too_near("left", present, "right", reserved) is not None
    assert one.first_nearer("left", body(0.111, 0.131), "right", reserved, present) is None
    for asked, rule in (
        (body(0.109, 0.2), "nearer than 30 mm they may only part"),
        (body(0.2, 0.129), "30 mm are kept"),
        (body(0.2, 0.13 - 5e-7), "30 mm are kept"),
    ):
        found = one.first_nearer("left", asked, "right", reserved, present)
        assert found is not None
        assert found[1].text.endswith(f"; {rule}")


def test_a_part_that_is_gripped_while_too_near_keeps_the_margin() -> None:
    hand, part = [[0.11, 0, 0]] * 2, [[0, 0.12, 0]] * 2
    present, asked = sections([[hand]], 0.05), sections([[hand, part]], 0.05)
    found = separation().first_nearer("left", asked, "right", row(1), present)
    assert found is not None
    assert found[1].link == "link 1"


def test_nothing_touches_what_a_robot_can_reach_that_may_be_anywhere() -> None:
    asked = row(40)  # from the origin to y = 390 mm, balls of 50 mm
    found = separation(0.0625).first_in_reach("left", asked, "right", (0.0, 1.0, 0.0), 0.5, LOST)
    assert found is not None
    index, refusal = found
    assert index == 39  # 1000 - 390 - 50 - 500 = 60 mm; 70 mm at the one before
    assert refusal.distance_m == pytest.approx(0.06, abs=1e-6)
    assert refusal.text == (f"left's link 0 would come within 60.0 mm of what right can reach, and {LOST}")
    assert separation(0.0625).first_in_reach("left", asked[:39], "right", (0.0, 1.0, 0.0), 0.5, LOST) is None
    exactly = sections([[[[0.25, 0, 0], [-1, 0, 0]]]], 0.125)
    assert separation(0.125).first_in_reach("left", exactly, "right", (1.0, 0.0, 0.0), 0.5, LOST) is not None


def test_nothing_touches_the_box_to_which_a_robot_is_confined() -> None:
    pose = np.eye(4)
    pose[:3, 3] = 0.0, 1.0, 0.0
    box = Box(np.array([1.0, 1.0, 1.0]), pose)
    found = separation(0.0625).first_at_box("left", row(80), "right", box)
    assert found is not None
    assert found[0] == 39
    assert found[1].text == (
        "left's link 0 would come within 60.0 mm of the box to which right is confined; 62.5 mm are kept"
    )
    assert found[1].by == "right"
    assert separation(0.0625).first_at_box("left", row(39), "right", box) is None
