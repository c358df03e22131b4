"""Only a sign of the button that is known to be young moves anything."""

from hypothesis import given
from hypothesis import strategies as st

from cell.view.hold import LATE_S, SILENT_S, Hold, Press

SIGN_S = 0.033


def held(hold: Hold, start: float, seconds: float, delay: float = 0.0) -> list[float]:
    """Hold the button over a quick line: each sign is answered by a ping; the times at which a sign counted."""
    counted, at = [], start
    while at < start + seconds:
        if hold.sign(at + delay):
            counted.append(at + delay)
        hold.answered(at + delay)
        at += SIGN_S
    return counted


def test_the_first_sign_moves_nothing_the_one_after_the_first_answer_does() -> None:
    hold = Hold()
    assert not hold.sign(1.0)
    hold.answered(1.001)
    assert hold.sign(1.033)
    assert hold.press is Press.HELD


def test_signs_without_answers_move_nothing() -> None:
    hold = Hold()
    assert not any(hold.sign(1.0 + k * SIGN_S) for k in range(100))


def test_an_answer_to_a_ping_of_before_this_press_proves_nothing() -> None:
    hold = Hold()
    hold.answered(0.99)
    assert not hold.sign(1.0)
    assert not hold.sign(1.033)


def test_what_lay_in_a_queue_moves_nothing_even_when_a_ping_is_answered_after_it() -> None:
    hold = Hold()
    assert not any(hold.sign(5.0) for _ in range(100))
    hold.answered(5.0001)
    assert hold.look(5.5) is Press.OVER


def test_signs_that_may_be_late_do_not_count() -> None:
    hold = Hold()
    hold.sign(1.0)
    hold.answered(1.001)
    assert hold.sign(1.15)
    assert hold.sign(1.001 + 0.99 * LATE_S)
    assert not hold.sign(1.001 + 1.01 * LATE_S)


def test_a_press_that_fell_silent_never_goes_on_until_the_button_was_let_go() -> None:
    hold = Hold()
    assert held(hold, 0.0, 0.5)
    assert hold.look(0.5 + SILENT_S + SIGN_S) is Press.OVER
    assert not held(hold, 1.0, 5.0)
    hold.let_go()
    assert held(hold, 10.0, 0.5)


def test_a_press_whose_signs_become_late_is_over() -> None:
    hold = Hold()
    held(hold, 0.0, 0.5)
    for k in range(40):
        hold.sign(0.5 + k * SIGN_S)
    assert hold.press is Press.OVER


def test_a_question_changes_nothing_but_what_time_has_ended() -> None:
    hold = Hold()
    held(hold, 0.0, 0.5)
    assert hold.look(0.5) is Press.HELD
    assert hold.look(0.5) is Press.HELD


@given(
    st.lists(
        st.tuples(st.sampled_from(["sign", "answered", "let_go", "look"]), st.floats(0.0, 0.3), st.floats(0.0, 2.0)),
        max_size=60,
    )
)
def test_what_counts_came_after_an_answer_younger_than_the_bound(steps: list[tuple[str, float, float]]) -> None:
    hold, now, answered, silent_since = Hold(), 0.0, -1.0, None
    for what, later, age in steps:
        now += later
        if what == "answered":
            answered = max(answered, now - age)
            hold.answered(now - age)
        elif what == "let_go":
            hold.let_go()
            silent_since = None
        elif what == "look":
            hold.look(now)
        elif hold.sign(now):
            assert now - answered <= LATE_S
            assert silent_since is None or now - silent_since <= SILENT_S
            silent_since = now
