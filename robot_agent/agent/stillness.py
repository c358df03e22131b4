"""Why a robot stands although its program runs."""

from cell.messages import Mode
from robot_agent.agent.corrections import Corrections
from robot_agent.agent.executive import Executive
from robot_agent.agent.interruption import Interruption
from robot_agent.agent.jogging import Jogging
from robot_agent.agent.pace import Pace
from robot_agent.agent.planning import Planned
from robot_agent.agent.program_run import ProgramRun
from robot_agent.agent.zone_claims import ZoneClaims


class Stillness:
    """Asked once a step; it also keeps account of the time spent in front of each zone."""

    def __init__(
        self,
        run: ProgramRun,
        zones: ZoneClaims,
        pace: Pace,
        jogging: Jogging,
        corrections: Corrections,
        interruption: Interruption,
    ) -> None:
        self._run = run
        self._zones = zones
        self._pace = pace
        self._jogging = jogging
        self._corrections = corrections
        self._interruption = interruption
        self._asked_at = 0.0

    def why(self, mode: Mode, executive: Executive | None, tick: int, now: float) -> str:
        """For people; empty while it moves, and where it has nothing to do."""
        passed_s, self._asked_at = now - self._asked_at, now
        if self._zones.kept_still and (executive is None or executive.at_rest(tick)):
            return self._zones.kept_still
        if mode is Mode.HALTED:
            return self._corrections.problem(now)
        if mode is Mode.JOGGING and self._jogging.source is not None:
            return self._jogging.ended_by or self._jogging.source.ruled_by
        if mode not in (Mode.RUNNING, Mode.RETURNING) or executive is None or not executive.at_rest(tick):
            return ""
        if mode is Mode.RETURNING:
            why, follower = self._interruption.waiting, self._interruption.follower
        else:
            why, follower = self._run.why_idle(tick, executive.cycle_s) or self._corrections.waiting, self._run.follower
        if why:
            return why
        if not self._zones.fresh(now):
            return "the manager is silent"
        override = abs(self._pace.override) if mode is Mode.RETURNING else self._pace.override
        return self._held_back(executive, follower, override, passed_s, now)

    def _held_back(
        self, executive: Executive, follower: Planned | None, override: float, passed_s: float, now: float
    ) -> str:
        """Who holds it back on its path or in front of the next motion."""
        newest = executive.timeline.newest
        if newest.followed is not None and newest.segment.ruled_by:
            return newest.segment.ruled_by
        motion, tau = newest.path, newest.path_segment.stop_tau
        if executive.at_motion_end and follower is not None:
            motion, tau = follower, 0.0
        if override <= 0.0:
            return newest.segment.ruled_by or f"{self._pace.requests[0].who}: at the beginning of this motion"
        blocking = [held for held in self._zones.holds_on(motion, now) if held[1].until > tau]
        if not blocking:
            return ""
        zone, hold = min(blocking, key=lambda held: held[1].tau)
        self._run.waited_s[zone] = self._run.waited_s.get(zone, 0.0) + passed_s
        return hold.who
