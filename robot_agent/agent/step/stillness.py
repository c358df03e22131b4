"""Why a robot stands although its program runs."""

from dataclasses import dataclass

from cell.messages import Mode
from robot_agent.agent.blocks.corrections import Corrections
from robot_agent.agent.blocks.executive import Executive
from robot_agent.agent.operator.jogging import Jogging
from robot_agent.agent.planning.plans import Planned
from robot_agent.agent.program.interruption import Interruption
from robot_agent.agent.program.pace import Pace
from robot_agent.agent.program.program_run import ProgramRun
from robot_agent.agent.zones.zone_claims import ZoneClaims


@dataclass(frozen=True, slots=True)
class Reason:
    """For people; empty while the robot moves, and where it has nothing to do."""

    text: str
    zone: str = ""
    """The zone that it waits for, where it is that."""


@dataclass(frozen=True, slots=True)
class Stillness:
    """Looks at a robot and changes nothing."""

    run: ProgramRun
    zones: ZoneClaims
    pace: Pace
    jogging: Jogging
    corrections: Corrections
    interruption: Interruption

    def reason(self, mode: Mode, executive: Executive | None, tick: int, now: float) -> Reason:
        """Why it stands, or jogs slower than wished."""
        if self.zones.kept_still and (executive is None or executive.at_rest(tick)):
            return Reason(self.zones.kept_still)
        if mode is Mode.HALTED:
            return Reason(self.corrections.problem(now))
        if mode is Mode.JOGGING and self.jogging.source is not None:
            return Reason(self.jogging.ended_by or self.jogging.source.ruled_by)
        if mode not in (Mode.RUNNING, Mode.RETURNING) or executive is None or not executive.at_rest(tick):
            return Reason("")
        if mode is Mode.RETURNING:
            why, follower = self.interruption.waiting, self.interruption.follower
        else:
            why, follower = self.run.why_idle(tick, executive.cycle_s) or self.corrections.waiting, self.run.follower
        if not why and not self.zones.fresh(now):
            return Reason(self.zones.silence)
        if follower is None and self.zones.unheard and (not why or mode is Mode.RETURNING):
            names = ", ".join(self.zones.unheard)
            return Reason(f"the manager has not said yet where zone {names} is, and nothing is planned before")
        if why:
            return Reason(why)
        override = abs(self.pace.override) if mode is Mode.RETURNING else self.pace.override
        return self._held_back(executive, follower, override, now)

    def _held_back(self, executive: Executive, follower: Planned | None, override: float, now: float) -> Reason:
        """Who holds it back on its path or in front of the next motion."""
        newest = executive.timeline.newest
        if newest.followed is not None and newest.segment.ruled_by:
            return Reason(newest.segment.ruled_by)
        motion, tau = newest.path, newest.path_segment.stop_tau
        if executive.at_motion_end and follower is not None:
            motion, tau = follower, 0.0
        if override == 0.0:
            return Reason(self.pace.requests[0].who)
        if override < 0.0:
            return Reason(newest.segment.ruled_by or f"{self.pace.requests[0].who}: at the beginning of this motion")
        blocking = [held for held in self.zones.holds_on(motion, now) if held[1].until > tau]
        if not blocking:
            return Reason("")
        zone, hold = min(blocking, key=lambda held: held[1].tau)
        return Reason(hold.who, zone)
