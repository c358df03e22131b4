"""Variables of the cell on their way from the robot that sets them to all others, which do not hear it."""

from collections.abc import Collection, Mapping

from cell.messages import CellVariables, RobotVariables
from cell.net.freshness import NewestOf


class Variables:
    """The newest that each robot has told. How old it is its receivers work out, by the cell time in it."""

    def __init__(self, owners: Mapping[str, str]) -> None:
        """`owners`: by variable, the robot that sets it."""
        self._robots: Collection[str] = frozenset(owners.values())
        self._newest: dict[str, NewestOf] = {}
        self._told: dict[str, RobotVariables] = {}
        self._new = False

    def heard(self, told: RobotVariables) -> None:
        """Take what a robot of the cell tells, unless something newer is known."""
        newest = self._newest.setdefault(told.robot, NewestOf()) if told.robot in self._robots else None
        if newest is not None and newest.accept(told.boot, told.era, told.sequence):
            self._told[told.robot], self._new = told, True

    def news(self) -> CellVariables | None:
        """What is to be passed on now."""
        new, self._new = self._new, False
        return CellVariables(dict(self._told)) if new else None
