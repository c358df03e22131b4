"""Whether a body keeps away from what it must not touch: random robots, things, spaces and motions, by brute force.

Each seed is one of these:

- a motion that a planner judges, against what brute force sees of it (`drawn_worlds`);
- a jog, or a correction, at full speed towards a border (`border_runs`): all that is sent keeps the margin, or goes no
  deeper where it begins in it, and what stands in front of it is near;
- a program through a space that an input switches (`gate_runs`), halted, slowed, backed up: all that is sent lies on
  the path that was looked at, and nothing moves inside while the space is on.

python -m tests.sim.body_checker --seeds 0:80
"""

import sys

from tests.sim.checker import search
from tests.unit.robot_agent.agent.zones import gate_runs
from tests.unit.robot_agent.workspace.border_runs import correction, fault, jog
from tests.unit.robot_agent.workspace.drawn_worlds import verdict

_KINDS = 8


def broken(seed: int) -> str:
    """What is wrong in the run of a seed, empty for nothing."""
    number, kind = divmod(seed, _KINDS)
    if kind < _KINDS - 3:
        found = verdict(number * (_KINDS - 3) + kind)
        if found is None or found.right:
            return ""
        return f"brute force sees {found.by or 'nothing'} at {found.short_s:.2f} s, told is {found.told_s:.2f} s"
    if kind == _KINDS - 1:
        return gate_runs.broken(number)
    what, run = ("jog", jog) if kind == _KINDS - 2 else ("correction", correction)
    wrong = fault(run(number))
    return f"a {what} {wrong}" if wrong else ""


if __name__ == "__main__":
    sys.exit(search("search bodies that come where they must not be", lambda seed: (broken(seed), 0.0)))
