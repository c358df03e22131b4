"""Set-up orders: one robot of the cell at a time; by the manager's word its motion begins and goes on.

A robot that is to be set up is named in the gateway's state. The manager lets one robot in, and says that it is free
when all others have confirmed that they stand and stay so (`ManagerState.setup`). That counts only as long as it
answers a young state of this gateway that named the robot.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

from cell.config.settings import Times
from cell.messages import Heard, ManagerState
from cell.net.freshness import NewestOf, Sent
from drive_gateway.gateway.robots.group import Then
from drive_gateway.gateway.robots.robot import Robot
from drive_gateway.gateway.robots.setup_plan import SetupCall, SetupRefused

PATIENCE_S = 1.5
"""An order waits so long for the others to stand; its caller has the answer within 2 s."""
MANAGER_GONE_S = 1.0
"""A manager of which nothing came for so long is not there."""


@dataclass(slots=True)
class _Order:
    """One robot's order, from the call to the end of its motion."""

    call: SetupCall
    id: str
    """Of the call; its holds name it."""
    then: Then | None
    """Who waits for the answer; None once the motion may begin."""
    until: float
    named_in: int | None = None
    """Sequence of the first state of the gateway that names the robot for this order."""


class SetupTurn:
    """The orders of one gateway.

    Args:
        gateway: its name.
        digest: of its configuration.
        robots: on this bus, by name.
        times: the cell's deadlines.
        states: when the gateway's states were sent.
    """

    def __init__(self, gateway: str, digest: str, robots: Mapping[str, Robot], times: Times, states: Sent) -> None:
        self._gateway = gateway
        self._digest = digest
        self._robots = robots
        self._fresh_s = times.fresh_s
        self._states = states
        self._orders: dict[str, _Order] = {}
        self._newest = NewestOf()
        self._manager: ManagerState | None = None
        self._heard_at = -inf

    def heard(self, state: ManagerState, at: float) -> None:
        """A manager's state arrived at `at` [s]."""
        if self._newest.accept(state.boot, state.epoch, state.sequence):
            self._manager, self._heard_at = state, at

    @property
    def echo(self) -> Heard | None:
        """For the gateway's next state."""
        return None if self._manager is None else Heard(self._manager.boot, self._manager.sequence)

    def names(self) -> tuple[str, ...]:
        """The robots that are to be set up, are, or may still move by it."""
        robots = self._robots.items()
        return tuple(name for name, robot in robots if name in self._orders or self._may_move(name, robot))

    def named(self, sequence: int) -> None:
        """A state of the gateway with `sequence` was made; it has the present `names`."""
        for order in self._orders.values():
            if order.named_in is None:
                order.named_in = sequence

    def elsewhere(self, robot: str) -> str:
        """Why nothing of `robot` may have torque: another one of this bus is set up. Empty when it may."""
        other = next((name for name in self.names() if name != robot), "")
        return f"{other} is being set up; one robot at a time" if other else ""

    def waiting(self, robot: str) -> bool:
        """An order of it waits for its turn."""
        order = self._orders.get(robot)
        return order is not None and order.then is not None

    def take(self, robot: Robot, call: SetupCall, call_id: str, now: float, then: Then) -> None:
        """An operator's order: it waits for its turn, at most `PATIENCE_S`, or is refused at once."""
        problem = self._refusal(robot, call, now)
        if robot.name in self._orders:
            problem = f"{robot.name} is being set up already"
        if problem:
            then(False, problem)
        else:
            self._orders[robot.name] = _Order(call, call_id, then, now + PATIENCE_S)

    def drop(self, robot: str, why: str) -> None:
        """What has not begun does not begin."""
        order = self._orders.get(robot)
        if order is not None and order.then is not None:
            del self._orders[robot]
            order.then(False, f"{robot}: {why}")

    def step(self, now: float) -> None:
        """One cycle: let motions begin whose turn it is, halt those whose turn is over."""
        for name, order in list(self._orders.items()):
            robot = self._robots[name]
            why_not = self._why_not(name, order, now)
            if order.then is not None:
                self._let_begin(robot, order, order.then, why_not, now)
            elif robot.group.setup.motion is None:
                del self._orders[name]
            elif why_not:
                robot.group.setup.motion.halt(why_not, now)

    def _let_begin(self, robot: Robot, order: _Order, then: Then, why_not: str, now: float) -> None:
        refusal = self._refusal(robot, order.call, now)
        if not refusal and why_not and now < order.until:
            return
        if refusal or why_not:
            del self._orders[robot.name]
            then(False, refusal or f"{robot.name} is not set up: {why_not}")
            return
        order.then = None
        then(True, robot.set_up(order.call, order.id, now))

    def _refusal(self, robot: Robot, call: SetupCall, now: float) -> str:
        """What waiting does not change."""
        if call.alone and self._manager_is_there(now):
            return f"{robot.name} is not set up: a manager is heard, so ask for it with the manager"
        try:
            robot.check_set_up(call, now)
        except SetupRefused as refused:
            return str(refused)
        return ""

    def _why_not(self, robot: str, order: _Order, now: float) -> str:
        """Why the motion may not begin or go on now; empty when it may."""
        if order.call.alone:
            return "a manager is heard" if self._manager_is_there(now) else ""
        state = self._manager
        if state is None or not self._manager_is_there(now):
            return "the manager is silent, and only it keeps the other robots still; start it: cell manager"
        if state.digest != self._digest:
            found = f"the manager's configuration is {state.digest}, this gateway's is {self._digest}"
            return f"{found}; start both with the same cell file"
        heard = state.heard_gateways.get(self._gateway)
        if self._states.age(heard, now) >= self._fresh_s:
            return f"the manager has not answered gateway {self._gateway} for {self._fresh_s:g} s"
        if state.setup is None or state.setup.robot != robot:
            return state.setup_refused.get(robot, "the manager has not let it in")
        answered = heard is not None and order.named_in is not None and heard.sequence >= order.named_in
        return (state.setup.reason or "others may move") if not (state.setup.free and answered) else ""

    def _manager_is_there(self, now: float) -> bool:
        return now - self._heard_at < MANAGER_GONE_S

    def _may_move(self, name: str, robot: Robot) -> bool:
        """A motion goes on; or the manager has it in set-up and it is not known to stand, as after a restart."""
        if robot.group.setup.motion is not None:
            return True
        state = self._manager
        if state is None or state.setup is None or state.setup.robot != name:
            return False
        known = all(node.operational or node.problem for node in {drive.node for drive in robot.group.nodes})
        return not (known and robot.group.standstill.at_rest)
