"""Drives with several habits, and everything else that may happen: a named state, a reason, and no motion by itself.

What is looked at in every cycle, and what happens, is in `TroubledBench`.
"""

import random

import pytest

from drive_gateway.sim.services.abort import AccessRefused
from tests.sim.unkind.bench import Refused
from tests.sim.unkind.expected import REFUSED
from tests.sim.unkind.troubled import IN_ALL, TroubledBench


def lives(seed: int) -> None:
    """From power-on through whatever is drawn to a motion in calm, or to a sentence about what the drive lacks."""
    try:
        world = TroubledBench(seed)
    except AccessRefused:
        # Of an object that another habit took away: there is no such drive.
        return
    try:
        world.lives()
    except Refused as refused:
        told = world.says_why(str(refused))
        assert any(name in REFUSED for name in world.names), f"seed {seed}: {told}"
        assert "node 1 (left J1)" in told, f"seed {seed}: {told}"
        assert any(remedy in told for remedy in REMEDIES), f"seed {seed}: {told}"
    except Exception as error:
        error.add_note(f"seed {seed}, a drive with {world.names}; {world.story}")
        raise


REMEDIES = (
    *(expected.tells[-1] for expected in REFUSED.values()),
    "did not stop, so it was stopped by NMT",
    "rest_window",
    "say a value that this drive takes",
    "take a drive that has it",
    "raise boot_timeout_s",
    "check power and wiring",
)
"""What helps, or why nothing does."""


@pytest.mark.parametrize("seed", range(IN_ALL))
def test_whatever_happens_a_robot_comes_back_or_one_sentence_says_why_not(seed: int) -> None:
    lives(seed)


@pytest.mark.soak
def test_so_do_five_hundred_others() -> None:
    rng = random.Random()
    for _ in range(500):
        lives(rng.randrange(2**32))
