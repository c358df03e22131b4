"""A robot that goes on in the moment in which it has come to rest: the ramp and the start are two motions."""

from dataclasses import replace

import numpy as np
import pytest

from cell.config.settings import Times
from cell.messages import Continue, Halt
from tests.unit import agent_world
from tests.unit.agent_runs import ended, running, until

CYCLE_S = 0.02
COARSE = replace(Times(), lead_s=0.05, nominal_s=0.16)
SHORT = "MJ J1=8 J5=5 F=100\nEND"


@pytest.mark.parametrize("steps", range(5, 12))
def test_jerk_is_kept_whenever_it_goes_on(steps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(agent_world, "CYCLE_S", CYCLE_S)
    world = running(SHORT, times=COARSE)
    until(world, lambda: world.state.governor is not None and world.state.governor.tau_s > 0.04)
    world.call(Halt())
    world.run(steps * agent_world.STEP_S)
    world.call(Continue())
    until(world, ended(world))
    jerk = np.abs(np.diff(np.array(world.played), n=3, axis=0)) / CYCLE_S**3
    assert (jerk / world.planner.limits.ramp_jerk).max() < 1.02
