"""SYNCs find the cell clock from any phase, never by a jump, and without a manager they run free."""

from hypothesis import given, settings
from hypothesis import strategies as st

from cell.messages import ManagerState
from drive_gateway.gateway.cycle.phase_lock import CATCH_UP_RATE, SILENT_S, PhaseLock

CYCLE_S = 0.004
STEP_S = 0.4e-6 * (1.0 + 1e-9)
"""What a cycle may differ by: 100 us in a second."""


class Bus:
    """The loop of one gateway on its own clock; the cell clock is `ahead_s` of it and runs `drift` faster."""

    def __init__(self, ahead_s: float, drift: float = 0.0) -> None:
        self.lock = PhaseLock(CYCLE_S)
        self.now = 100.0
        self.ahead_s, self.drift = ahead_s, drift
        self.boot, self.sequence = "m1", 0
        self.trims: list[float] = []

    def run(self, seconds: float, manager: bool = True) -> None:
        for number in range(round(seconds / CYCLE_S)):
            if manager and number % 50 == 0:
                self.sequence += 1
                # Half of the states are 0.2 ms on their way, and more of them later.
                late_s = 0.0002 * (1 + self.sequence % 3)
                sent = self.cell_time - late_s
                self.lock.heard(
                    ManagerState("c", self.boot, int(self.boot[1:]), self.sequence, sent, "digest"), self.now
                )
            self.trims.append(self.lock.trim(self.now))
            self.now += CYCLE_S + self.trims[-1]

    @property
    def cell_time(self) -> float:
        return self.now + self.ahead_s + self.drift * self.now

    @property
    def off_s(self) -> float:
        """Of the next SYNC; what the cell clock is heard late by is the same for all gateways of a host."""
        seen = self.cell_time - 0.0002
        return seen - CYCLE_S * round(seen / CYCLE_S)


@settings(max_examples=5)
@given(st.floats(0.0, CYCLE_S), st.floats(-30e-6, 30e-6))
def test_any_phase_is_led_to_the_cell_clock_in_small_steps_and_held_against_its_drift(
    phase_s: float, drift: float
) -> None:
    bus = Bus(50.0 + phase_s, drift)
    bus.run(45.0)
    # The clock is read off the best of two seconds, in which it drifts.
    assert abs(bus.off_s) < 20e-6 + 2.0 * abs(drift)
    assert max(abs(trim) for trim in bus.trims) <= STEP_S


def test_two_gateways_with_other_clocks_end_in_step() -> None:
    left, right = Bus(3.0011), Bus(-41.0023, 20e-6)
    left.run(40.0)
    right.run(40.0)
    assert abs(left.off_s - right.off_s) < 60e-6


def test_a_clock_that_jumps_and_a_new_manager_move_the_phase_as_slowly_as_ever() -> None:
    bus = Bus(3.0)
    bus.run(20.0)
    bus.ahead_s += 0.0015
    bus.run(20.0)
    bus.boot, bus.ahead_s = "m2", -99.9987
    bus.run(30.0)
    assert max(abs(trim) for trim in bus.trims) <= STEP_S
    assert abs(bus.off_s) < 20e-6


def test_without_a_manager_the_loop_runs_free_and_goes_on_when_one_is_heard() -> None:
    bus = Bus(3.001)
    bus.run(0.1, manager=False)
    assert set(bus.trims) == {0.0}
    bus.run(1.0)
    assert bus.trims[-1] != 0.0
    assert bus.lock.error_s is not None
    bus.run(SILENT_S + 0.1, manager=False)
    assert (bus.trims[-1], bus.lock.error_s) == (0.0, None)
    bus.run(0.1)
    assert bus.trims[-1] != 0.0


@given(st.floats(0.2 * CYCLE_S, 0.05))
@settings(max_examples=20, deadline=None)
def test_after_a_stall_the_phase_is_caught_up_within_2_s_and_held_as_gently_as_before(stall_s: float) -> None:
    bus = Bus(3.0)
    bus.run(40.0)
    bus.trims.clear()
    bus.now += stall_s
    bus.run(2.0)
    assert abs(bus.off_s) < 50e-6
    assert max(abs(trim) for trim in bus.trims) <= CATCH_UP_RATE * CYCLE_S * (1.0 + 1e-9)
    bus.trims.clear()
    bus.run(20.0)
    assert max(abs(trim) for trim in bus.trims) <= STEP_S
    assert abs(bus.off_s) < 20e-6
