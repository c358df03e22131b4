"""Which zones a program comes to, and when."""

from collections.abc import Iterable

from robot_agent.agent.executive import Executive
from robot_agent.agent.lookahead import Item
from robot_agent.agent.planning import Planned
from robot_agent.language import Pause

_AHEAD_S = 0.6
"""A zone is asked for this long, plus the time to stop, before it is entered; a grant takes about 0.05 s."""


def zones_ahead(executive: Executive, items: Iterable[Item], tick: int, pause_s: float = 0.0) -> dict[str, float]:
    """The zones that are crossed soon after `tick`: zone to seconds until then; `items` are what comes next.

    The next motion does not begin within `pause_s`.
    """
    wants: dict[str, float] = {}
    block, index = executive.timeline.at(tick)
    newest = executive.timeline.newest
    ahead_s = _AHEAD_S + (newest.rest_tick - tick) * executive.cycle_s
    until_s = -block.path_segment.state(index).tau
    seen: list[object] = []
    for item in (block.path, newest.path, *items):
        if not isinstance(item, Planned) or item.motion not in (block.path.motion, newest.path.motion):
            until_s = max(until_s, pause_s)
        if isinstance(item, Pause):
            until_s += item.duration_s
        elif isinstance(item, Planned) and item.motion not in seen:
            seen.append(item.motion)
            for crossing in item.crossings:
                if until_s + crossing.leave_tau > 0.0 and until_s + crossing.enter_tau < ahead_s:
                    wants.setdefault(crossing.zone, max(0.0, until_s + crossing.enter_tau))
            until_s += item.motion.duration_s
    return wants
