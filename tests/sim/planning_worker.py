"""What stands for the planning process of a robot: results in the order of the requests, after the time they take."""

from collections import deque
from collections.abc import Callable, Iterable

from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import ExtendRequest, PlanFailed, Planned, PlanRequest
from tests.sim.clock import Clock

_LEAST_S = 0.03


class SimWorker:
    """Stands for `PlanWorker`; one request after the other, each 30 ms and a share of its motion's duration."""

    def __init__(self, planner: Planner, clock: Clock, share: float, planned: Callable[[Planned], None]) -> None:
        self._planner = planner
        self._clock = clock
        self._share = share
        self._tell = planned
        self._free_at = clock.now
        self._results: deque[tuple[float, Planned | PlanFailed]] = deque()

    def submit(self, request: PlanRequest | ExtendRequest) -> None:
        """Hand a request to the planner."""
        result = self._planner.plan(request)
        takes_s = _LEAST_S
        if isinstance(result, Planned):
            takes_s += self._share * result.motion.duration_s
            self._tell(result)
        self._free_at = max(self._free_at, self._clock.now) + takes_s
        self._results.append((self._free_at, result))

    def drop(self, ids: Iterable[int]) -> None:
        """Forget requests; the time that they take is over all the same."""
        unwanted = set(ids)
        self._results = deque(each for each in self._results if each[1].id not in unwanted)

    def results(self) -> list[Planned | PlanFailed]:
        """What is planned since the last look."""
        results = []
        while self._results and self._results[0][0] <= self._clock.now:
            results.append(self._results.popleft()[1])
        return results
