"""Variables of the cell: each is set by the programs of one robot and told to all others.

A LET happens where the robot is then, at rest or where it passes the end of the move before, not where its program is
read. What others tell counts by the cell time at which they told it; who sets a variable keeps it from run to run, and
after the start of its agent it is not set.
"""

from math import inf

from cell.messages import CellVariables, RobotVariables, VariableValue
from cell.net.freshness import NewestOf
from robot_agent.agent.cell_clock import CellClock
from robot_agent.language import Relation

FRESH_S = 0.6
_PERIOD_S = 0.1


class SharedVariables:
    """Those that this robot sets, and the newest of the others'."""

    def __init__(self, robot: str, boot: str, owners: dict[str, str], clock: CellClock) -> None:
        """`owners`: by variable, the robot that sets it."""
        self._robot, self._boot, self._owners, self._clock = robot, boot, owners, clock
        self._mine: dict[str, VariableValue] = {}
        self._others: dict[str, RobotVariables] = {}
        self._newest: dict[str, NewestOf] = {}
        self._sequence = 0
        self._due = 0.0
        self._now = 0.0

    def look(self, now: float) -> None:
        """What is set from here on is set at `now` [s]."""
        self._now = now

    @property
    def mine(self) -> dict[str, float]:
        """Those of this robot that are set."""
        return {name: each.value for name, each in self._mine.items()}

    def set(self, name: str, value: float, program: str, line: int) -> None:
        """The robot has come to a LET."""
        self._mine[name] = VariableValue(value, program, line, self._clock.moment(self._now))
        self._due = 0.0

    def heard(self, news: CellVariables) -> None:
        """Take what the manager passes on of other robots, unless something newer is known."""
        for told in (each for each in news.robots.values() if each.robot in self._owners.values()):
            if self._newest.setdefault(told.robot, NewestOf()).accept(told.boot, told.era, told.sequence):
                self._others[told.robot] = told

    def news(self, era: int) -> RobotVariables | None:
        """What is to be told now; `era` is the number of the robot's claim."""
        if self._robot not in self._owners.values() or self._now < self._due:
            return None
        self._due = self._now + _PERIOD_S
        self._sequence += 1
        at = None if self._clock.uncertain(self._now) else self._clock.moment(self._now)
        return RobotVariables(self._robot, self._boot, era, self._sequence, at, dict(self._mine))

    def holds(self, relation: Relation, now: float, oldest_s: float) -> bool | None:
        """Whether a comparison holds, by what was told less than `oldest_s` ago; None where nobody knows."""
        if self.why_unknown(relation, now, oldest_s):
            return None
        return relation.holds(lambda name: self._others[self._owners[name]].values[name].value)

    def why_unknown(self, relation: Relation, now: float, oldest_s: float) -> str:
        """Why nobody knows, for people; empty when it is known."""
        return next((why for name in relation.variables if (why := self._why(name, now, oldest_s))), "")

    def _why(self, name: str, now: float, oldest_s: float) -> str:
        robot = self._owners[name]
        told = self._others.get(robot)
        age_s = inf if told is None or told.at is None else self._clock.age(told.at, now)
        if told is None or age_s >= min(oldest_s, FRESH_S):
            return f"nothing young is heard of variable {name}, which {robot} sets"
        return "" if name in told.values else f"{robot} has not set variable {name} since its agent was started"
