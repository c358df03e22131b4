"""A whole program planned without a cell: what the robot would do if nothing held it up."""

import numpy as np

from robot_agent.agent.lookahead import Lookahead, Waiting
from robot_agent.agent.planning import Plan, PlanFailed, Planned, Planner
from robot_agent.language import Finished, Program, ProgramFault


def dry_run(planner: Planner, program: Program, longest_s: float) -> tuple[list[Planned], PlanFailed | None]:
    """The motions of a program from home, its pauses left out, and the failure that ends it, if one does.

    A program that never ends is cut off once its motions last `longest_s`.
    """
    lookahead = Lookahead()
    lookahead.start(program, np.asarray(planner.model.home))
    motions: list[Planned] = []
    while sum(planned.motion.duration_s for planned in motions) < longest_s:
        for effect in lookahead.fill(()):
            if isinstance(effect, Plan):
                lookahead.planned(planner.plan(effect.request))
        match lookahead.head:
            case Planned() as planned:
                motions.append(planned)
            case PlanFailed() as failed:
                return motions, failed
            case ProgramFault(line, text):
                return motions, PlanFailed(0, line, text)
            case Finished() | Waiting() | None:
                break
            case _:
                pass
        lookahead.advance()
    return motions, None
