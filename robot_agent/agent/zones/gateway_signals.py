"""What the robot's gateway says of its digital inputs, and how old that is at most.

A gateway repeats the newest manager state that it heard, and that the newest presence of this robot that the manager
had heard. So what the gateway says is no older than that presence (`docs/architecture.md`, section 4.2).
"""

from collections import OrderedDict
from collections.abc import Collection

from cell.messages import GatewayState, Heard, ManagerState
from cell.net.freshness import NewestOf, Sent

FRESH_S = 0.6
"""What an input is counts for so long after the gateway can have said so: after each manager state, or five times per
second without one."""
_REMEMBERED = 200
"""Manager states whose echo of this robot is remembered: more than come in the two seconds that a presence counts."""


class GatewaySignals:
    """The newest state of the gateway, as far as it is about this robot."""

    def __init__(self, robot: str, sent: Sent) -> None:
        """`sent` are this robot's presences."""
        self._robot = robot
        self._sent = sent
        self._echoes: OrderedDict[tuple[str, int], Heard | None] = OrderedDict()
        self._newest = NewestOf()
        self._state: GatewayState | None = None

    def heard_manager(self, state: ManagerState) -> None:
        """Remember which presence a manager state answers."""
        self._echoes[state.boot, state.sequence] = state.heard.get(self._robot)
        while len(self._echoes) > _REMEMBERED:
            self._echoes.popitem(last=False)

    def heard_gateway(self, state: GatewayState) -> None:
        """Take what the robot's gateway says, unless something newer is known."""
        if self._newest.accept(state.boot, state.era, state.sequence):
            self._state = state

    @property
    def input_names(self) -> Collection[str] | None:
        """Of the robot's inputs; None before the gateway has told them."""
        return None if self._state is None else self._state.inputs.get(self._robot, {}).keys()

    def closed(self, name: str, now: float, oldest_s: float = FRESH_S) -> bool | None:
        """Whether an input is closed, by what was said less than `oldest_s` ago; None where that is not known."""
        return None if self.why_unknown(name, now, oldest_s) else self._inputs[name]

    def why_unknown(self, name: str, now: float, oldest_s: float = FRESH_S) -> str:
        """Why nobody knows whether an input is closed, for people; empty when it is known."""
        if name not in self._inputs:
            return f"the gateway has not told input {name}"
        if self._age(now) >= oldest_s:
            return f"nothing young is heard of input {name}"
        return f"input {name} is not known" if self._inputs[name] is None else ""

    @property
    def _inputs(self) -> dict[str, bool | None]:
        return {} if self._state is None else self._state.inputs.get(self._robot, {})

    def _age(self, now: float) -> float:
        """Upper bound [s] of the age of what the gateway said last."""
        heard = None if self._state is None else self._state.heard
        return self._sent.age(None if heard is None else self._echoes.get((heard.boot, heard.sequence)), now)
