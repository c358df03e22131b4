"""The ring keeps the newest, within its bounds, and of each key one before that."""

from hypothesis import given
from hypothesis import strategies as st

from cell.recording.ring import Ring, Told

TOLD = st.lists(st.tuples(st.sampled_from("abc"), st.binary(max_size=300)), max_size=60)


def payloads(ring: Ring) -> list[tuple[str, bytes]]:
    return [(key, payload) for _, key, payload in ring.told()]


@given(TOLD, st.sampled_from([2000, 10**6]), st.integers(1, 20))
def test_what_is_told_is_the_newest_of_each_key_and_then_all_without_a_gap(
    told: list[tuple[str, bytes]], most_bytes: int, keep: int
) -> None:
    ring = Ring(float(keep), most_bytes)
    for second, (key, payload) in enumerate(told):
        ring.store(float(second), key, payload)
        ring.pack(float(second))
    every: list[Told] = [(float(second), key, payload) for second, (key, payload) in enumerate(told)]

    def cut(at: int) -> list[Told]:
        """What is told where all before `at` had to go."""
        return sorted({key: each for each in every[:at] for key in (each[1],)}.values()) + every[at:]

    too_old = max(0, len(every) - keep - 1)
    cuts = [at for at in range(too_old, len(every) + 1) if list(ring.told()) == cut(at)]
    assert cuts
    assert most_bytes == 2000 or cuts[0] == too_old


def test_a_burst_takes_no_more_memory_than_allowed() -> None:
    ring = Ring(60.0, 1000)
    for i in range(100):
        ring.store(0.0, "a", bytes([i]) * 100)
    assert ring.lost == 90
    ring.pack(0.0)
    assert len(payloads(ring)) == 10


def test_what_comes_late_is_told_in_the_order_in_which_it_was_said() -> None:
    ring = Ring(60.0, 10**6)
    for at in (0.0, 2.0, 1.0, 3.0, 2.5):
        ring.store(at, "a", str(at).encode())
    ring.pack(2.0)
    assert payloads(ring) == [("a", b"0.0"), ("a", b"1.0"), ("a", b"2.0")]
    ring.pack(3.0)
    assert payloads(ring)[3:] == [("a", b"2.5"), ("a", b"3.0")]
