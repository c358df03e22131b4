"""Governor and playout together while blocks are lost and late: no step in velocity, all limits kept, on the path."""

import numpy as np
import pytest

from cell.messages import SetpointBlock
from drive_gateway.gateway.playout.playout import Accepted, Playout
from robot_agent.trajectory import Governor, RateRequest, Segment
from tests.unit.gateway_world import axis
from tests.unit.governor_drive import CYCLE_S, LIMITS, MOTIONS, STEP

LEAD = 10
"""Ticks between the newest feedback and the tick at which a block joins."""


@pytest.mark.parametrize("loss", [pytest.param(0.05, marks=pytest.mark.soak), 0.2])
@pytest.mark.parametrize("number", range(len(MOTIONS)))
def test_blocks_join_without_a_step_whatever_is_lost_or_late(loss: float, number: int) -> None:
    motion, rng = MOTIONS[number], np.random.default_rng(number)
    ramp = LIMITS.ramp_acceleration_bounds[1]
    axes = [axis(f"J{i + 1}", i + 1, speed=LIMITS.velocity[i], acceleration=ramp[i]) for i in range(6)]
    playout = Playout(axes, CYCLE_S, motion.q(np.array(0.0)), tick=100)
    playout.own(7)
    playout.go_live()
    governor = Governor(motion, LIMITS, CYCLE_S, nominal_s=0.12)
    known: dict[int, tuple[int, Segment]] = {0: (100, governor.rest(0.0))}
    under_way: list[tuple[int, SetpointBlock]] = []
    played, lost, refused, rate = [playout.position], 0, 0, 1.0
    for sequence in range(1, 2000):
        first, segment = known[playout.block]
        join = max(playout.tick + LEAD, first)
        rate = rng.choice([1.0, 0.3, 0.0]) if rng.random() < 0.05 else rate
        answer = governor.next(segment, join - first, (RateRequest(rate, "override"),), ())
        known[sequence] = (join, answer)
        block = SetpointBlock("r", 7, sequence, playout.block, join, CYCLE_S, answer.nominal, answer.q, answer.qd)
        if rng.random() < loss:
            lost += 1
        else:
            late = int(rng.integers(1, 40)) if rng.random() < loss else 1
            under_way.append((playout.tick + late, block))
        for _ in range(STEP):
            for due, arrived in [each for each in under_way if each[0] <= playout.tick]:
                under_way.remove((due, arrived))
                refused += not isinstance(playout.offer(arrived), Accepted)
            played.append(playout.advance()[0])
        if playout.at_rest and segment.stop_tau >= motion.duration_s:
            break
    q = np.array(played)
    assert lost > 0
    np.testing.assert_allclose(q[-1], motion.q(np.array(motion.duration_s)), atol=1e-9)
    for order, limit in enumerate((LIMITS.velocity, LIMITS.ramp_acceleration_bounds[1], LIMITS.ramp_jerk), 1):
        assert (np.abs(np.diff(q, order, axis=0)).max(axis=0) / CYCLE_S**order <= 1.003 * limit).all()
    path = motion.q(np.linspace(0.0, motion.duration_s, 20_001))
    assert max(np.abs(path - sample).max(axis=1).min() for sample in q[::7]) < 2e-4
