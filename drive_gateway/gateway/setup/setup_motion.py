"""Set-up: motion that the drives of one robot make by themselves, as long as an operator holds it.

Such a motion has no block and no path, so the robot counts as not referenced while it lasts: its body is unknown.
"""

from collections.abc import Sequence

from drive_gateway.cia402.setup_objects import HOMING, PROFILE_VELOCITY, SetupOrder, trial_order
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.setup.first_motion import FARTHEST
from drive_gateway.gateway.setup.setup_axis import SetupAxis, Stage
from drive_gateway.gateway.trouble import Trouble
from drive_gateway.gateway.watch.limit_switches import limit_switches

HOLD_S = 0.5
"""A motion whose operator did not hold it this lately is stopped."""


class SetupMotion:
    """Groups of axes, one group after another; the axes of a group start in the same cycle.

    The drives are told nothing before the operator holds it: who has let go by then, or never heard that it may begin,
    starts nothing.

    Args:
        what: what goes on, for people.
        groups: drives and their orders.
        now: it may begin from here.
    """

    def __init__(self, what: str, groups: Sequence[Sequence[tuple[Drive, SetupOrder]]], now: float) -> None:
        self.what = what
        self._waiting = [list(group) for group in groups]
        self._axes: list[SetupAxis] = []
        self._problem = ""
        self._may_begin_at = self._held_at = now
        self._held = False

    @property
    def ended(self) -> bool:
        return not self._waiting and all(axis.stage is Stage.ENDED for axis in self._axes)

    @property
    def problem(self) -> str:
        """Why it ended early; empty when all went well."""
        return self._problem

    def progress(self) -> str:
        """What each axis of the present group does."""
        return "; ".join(axis.progress() for axis in self._axes) or "begins when it is held"

    def hold(self, at: float) -> None:
        """The operator wanted it at `at` [s], or later."""
        self._held_at = max(self._held_at, at)
        self._held = self._held or at >= self._may_begin_at

    def stop(self, reason: str, now: float) -> None:
        """Stop every axis; what has not begun does not begin."""
        self._problem = self._problem or reason
        self._waiting = []
        for axis in self._axes:
            axis.stop(reason, now)

    def halt(self, reason: str, now: float) -> None:
        """Halt every axis that its drive moves on its ramp; what has not begun does not begin."""
        self._problem = self._problem or reason
        self._waiting = []
        for axis in self._axes:
            axis.halt(reason, now)

    def troubles(self) -> list[Trouble]:
        """Of drives that did not switch off."""
        return [axis.trouble for axis in self._axes if axis.trouble is not None]

    def controls(self, node: Drive) -> SetupAxis | None:
        """The axis that commands this node now."""
        return next((axis for axis in self._axes if axis.node is node and axis.stage is not Stage.ENDED), None)

    def step(self, now: float) -> None:
        """One cycle."""
        if now - self._held_at > HOLD_S:
            self.halt(f"the operator let go of it ({self.progress()})", now)
        for axis in self._axes:
            axis.step(now)
            if axis.problem:
                self.stop(axis.problem, now)
            if axis.attained and axis.order.mode == HOMING:
                axis.node.reference.found()
            if axis.attained and axis.order.trial:
                axis.node.tried = True
        if all(axis.stage is Stage.READY for axis in self._axes):
            for axis in self._axes:
                axis.start(now)
        if self._held and self._waiting and all(axis.stage is Stage.ENDED for axis in self._axes):
            self._begin(now)

    def _begin(self, now: float) -> None:
        """The first group that waits; before it its axes whose units have not been tried since their drive started."""
        trials = [(node, _trial(node, order, now)) for node, order in self._waiting[0] if _new(node, order)]
        self._axes = [SetupAxis(node, order, now) for node, order in trials or self._waiting.pop(0)]


def _new(node: Drive, order: SetupOrder) -> bool:
    return node.axis.try_units and not (node.tried or order.still or order.press is not None)


def _trial(node: Drive, order: SetupOrder, now: float) -> SetupOrder:
    """The way of the motion, or back where a limit switch or a limit is near.

    It goes back only where what follows starts from here: a drive refuses the way into an active switch.
    """
    switches = list(limit_switches([node], now))
    ways = [
        way
        for way in (order.free, -order.free)
        if not any(switch.forbids(way) for switch in switches) and not _leaves_limits(node, way)
    ]
    return trial_order(node.axis, (ways or [order.free])[0], back=order.mode == PROFILE_VELOCITY and not switches)


def _leaves_limits(node: Drive, way: int) -> bool:
    axis = node.axis
    if axis.limits is None or not node.reference.known:
        return False
    farthest = way * FARTHEST[axis.linear] * abs(axis.counts_per_unit)
    ahead = axis.offset + ((node.counts or 0) + farthest) / axis.counts_per_unit
    return not axis.limits[0] <= ahead <= axis.limits[1]
