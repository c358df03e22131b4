"""Plans of a generated cell are remembered: the same request has the same answer in every run."""

import copy
import pickle
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace

from robot_agent.agent.planning.plans import ExtendRequest, PlanFailed, Planned, PlanRequest
from tests.sim.world import World

_MOST = 400
_Plan = Callable[[PlanRequest | ExtendRequest], Planned | PlanFailed]
_plans: OrderedDict[tuple[str, str, bytes], Planned | PlanFailed] = OrderedDict()


def remember_plans(world: World) -> None:
    """Before the world begins to run."""
    for robot, planner in world.planners.items():
        planner.plan = _remembering(planner.plan, world.cell.digest, robot)  # type: ignore[method-assign]


def _remembering(plan: _Plan, digest: str, robot: str) -> _Plan:
    def remembered(request: PlanRequest | ExtendRequest) -> Planned | PlanFailed:
        if isinstance(request, ExtendRequest):
            return plan(request)
        key = digest, robot, pickle.dumps((request.steps, request.start, request.zones, request.frames, request.tuning))
        known = _plans.get(key)
        if known is None:
            known = _plans[key] = plan(request)
            while len(_plans) > _MOST:
                _plans.popitem(last=False)
        if isinstance(known, PlanFailed):
            return replace(known, id=request.id)
        # As from a planning process: an object of its own.
        return replace(known, id=request.id, motion=copy.copy(known.motion))

    return remembered
