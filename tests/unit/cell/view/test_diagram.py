import numpy as np

from cell.config.settings import SeparationSettings
from cell.messages import PlannedWay, Presence, Sections
from cell.messages.sections import Way
from cell.view.diagram import Diagram, Diagrams, shown, svg, too_near
from tests.unit.cell.view.room import pieces, presence, seen

PAIR = ("left", "right")
NOTHING_FIXED = frozenset[int](), frozenset[int]()


def plan(robot: str, number: int, of: Sections) -> PlannedWay:
    return PlannedWay(robot, "b", 1, number, True, of)


def at(robot: str, number: int, *pieces_of_sections: int, owned: int = 1) -> Presence:
    way = Way(pieces(list(pieces_of_sections)), 1, owned, plan=number, pieces=np.array(pieces_of_sections, np.uint32))
    told = presence(robot, 0.0)
    return Presence(robot, "b", 1, 1, None, "d", told.body, 0.5, way=way)


def diagrams(margin_m: float = 0.05) -> Diagrams:
    return Diagrams(PAIR, SeparationSettings(margin_m))


def test_pieces_are_closed_exactly_where_they_are_nearer_than_the_margin() -> None:
    first, second = pieces(range(6)), pieces(range(4), y=0.23)
    for margin in (0.02, 0.04, 0.2):
        away = np.hypot(0.2 * (np.arange(6)[:, None] - np.arange(4)), 0.23) - 0.2
        assert (too_near(first, second, margin, NOTHING_FIXED) == (away < margin)).all()


def test_what_never_moves_of_both_closes_nothing() -> None:
    first = pieces(range(3))
    assert too_near(first, first, 0.05, NOTHING_FIXED).any()
    assert not too_near(first, first, 0.05, (frozenset({0}), frozenset({0}))).any()
    assert too_near(first, first, 0.05, (frozenset({0}), frozenset())).any()


def test_the_way_goes_on_through_plans_that_go_on() -> None:
    found = diagrams()
    right = plan("right", 1, pieces(range(5), y=1.0))
    found.look(seen(plan("left", 1, pieces(range(5))), right, at("left", 1, 3, 4, owned=2), at("right", 1, 0)))
    found.look(seen(plan("left", 2, pieces(range(3, 9))), right, at("left", 2, 2, 3), at("right", 1, 1)))
    diagram = found.of(PAIR)
    assert diagram is not None
    assert diagram.began == (3, 0)
    assert diagram.closed.shape == (6, 5)
    assert diagram.taken == ((3, 0), (5, 1))
    assert diagram.may == (5, 1)


def test_a_program_that_comes_by_again_goes_on_and_not_back() -> None:
    """The agent tells the last of the pieces that are the same space."""
    found = diagrams()
    right = plan("right", 1, pieces(range(5), y=1.0))
    rounds = pieces([*range(10), *range(10)])
    for told, counted in ((10, 0), (14, 4), (19, 9), (10, 10), (13, 13)):
        found.look(seen(plan("left", 1, rounds), right, at("left", 1, told), at("right", 1, 0)))
        assert found.of(PAIR) is not None
        assert found.of(PAIR).at[0] == counted  # type: ignore[union-attr]


def test_a_way_of_its_own_begins_anew() -> None:
    found = diagrams()
    right = plan("right", 1, pieces(range(5), y=1.0))
    found.look(seen(plan("left", 1, pieces(range(5))), right, at("left", 1, 4), at("right", 1, 2)))
    found.look(seen(plan("left", 2, pieces(range(20, 25))), right, at("left", 2, 0), at("right", 1, 2)))
    diagram = found.of(PAIR)
    assert diagram is not None
    assert diagram.taken == ((0, 2),)


def test_who_has_no_way_planned_is_named() -> None:
    found = diagrams()
    found.look(seen(plan("left", 1, pieces(range(5))), at("left", 1, 0)))
    assert found.of(PAIR) is None
    assert "right: no way planned" in shown(found, PAIR)


def test_a_cell_that_keeps_nobody_apart_has_no_diagram() -> None:
    found = Diagrams(PAIR, None)
    found.look(seen(plan("left", 1, pieces(range(5))), at("left", 1, 0)))
    assert found.pairs == ()


def test_the_picture_has_each_closed_stretch_and_no_markup_of_others() -> None:
    closed = np.zeros((6, 3), bool)
    closed[1:3, 0] = closed[4, 0] = closed[2, 2] = True
    picture = svg(Diagram(("<b>", "right"), (0, 0), closed, (0, 0), (1, 1), ((0, 0),)))
    assert picture.count("z") >= 3
    assert picture.split("<path d='")[1].split("'")[0].count("M") == 3
    assert "<b>" not in picture
