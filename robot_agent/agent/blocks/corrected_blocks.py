"""Blocks of a planned motion with a live correction on top."""

from robot_agent.agent.blocks.timeline import Followed, SentBlock
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Planned
from robot_agent.trajectory import Governor
from robot_agent.trajectory.sources import CorrectedSource, States, sampled


def resume(source: CorrectedSource, base: SentBlock, tick: int, planned: Planned, governor: Governor) -> None:
    """Let `source` go on at `tick` from what `base` leads to there.

    `planned`, with its `governor`, is what `base` follows, or what comes behind that.
    """
    followed = base.followed
    if followed is None:
        return
    ticks = tick - base.first_tick
    if planned is followed.planned:
        source.resume(ticks, followed.given, governor)
    else:
        source.resume(ticks, followed.given)
        source.follow(governor)


def corrected_block(
    planner: Planner, source: CorrectedSource, base: SentBlock, tick: int, planned: Planned, nominal: int, number: int
) -> SentBlock:
    """The block from `tick` on, `nominal` ticks and the ramp behind them; it joins `base` there."""
    before = base.segment.history(base.index(tick))
    present = States.one(source.state)
    given = source.samples(nominal)
    states = present.then(given).then(source.brake())
    motion, segment = sampled(planner.model, states, given.count, before, planner.cycle_s, source.ruled_by)
    return SentBlock(number, tick, planner.sampled(motion), segment, Followed(planned, source.given, source))
