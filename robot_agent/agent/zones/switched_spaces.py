"""Which spaces of the robot are off now: those that its program has switched off, and those with a closed input."""

from collections import OrderedDict
from collections.abc import Mapping

from cell.messages import GatewayState, Heard, ManagerState
from cell.net.freshness import NewestOf, Sent

FRESH_S = 0.6
"""An input counts as closed for so long after the gateway can have said so; it does five times per second."""
_REMEMBERED = 200
"""Manager states whose echo of this robot is remembered: more than come in the two seconds that a presence counts."""


class SwitchedSpaces:
    """What may be off counts as on unless the contrary is known and young.

    A gateway repeats the newest manager state that it heard, and that the newest presence of this robot that the
    manager had heard. So what the gateway says is no older than that presence (`docs/architecture.md`, section 4.2).
    """

    def __init__(self, robot: str, inputs: Mapping[str, str], sent: Sent) -> None:
        """`inputs`: by space, the input that switches it off; `sent` are this robot's presences."""
        self._robot = robot
        self._inputs = inputs
        self._sent = sent
        self._echoes: OrderedDict[tuple[str, int], Heard | None] = OrderedDict()
        self._newest = NewestOf()
        self._state: GatewayState | None = None
        self.by_program: frozenset[str] = frozenset()
        """What the program has switched off."""

    def heard_manager(self, state: ManagerState) -> None:
        """Remember which presence a manager state answers."""
        self._echoes[state.boot, state.sequence] = state.heard.get(self._robot)
        while len(self._echoes) > _REMEMBERED:
            self._echoes.popitem(last=False)

    def heard_gateway(self, state: GatewayState) -> None:
        """Take what the robot's gateway says, unless something newer is known."""
        if self._newest.accept(state.boot, state.era, state.sequence):
            self._state = state

    def off(self, now: float) -> frozenset[str]:
        """The spaces that are off."""
        return self.by_program.union(space for space in self._inputs if not self.why_on(space, now))

    def why_on(self, space: str, now: float) -> str:
        """Why a space is on that an input switches, for people; empty while it is off."""
        name = self._inputs[space]
        inputs = {} if self._state is None else self._state.inputs.get(self._robot, {})
        if name not in inputs:
            return f"space {space}: the gateway has not told input {name}"
        if self._age(now) >= FRESH_S:
            return f"space {space}: nothing young is heard of input {name}"
        closed = inputs[name]
        if closed is None:
            return f"space {space}: input {name} is not known"
        return "" if closed else f"space {space}: input {name} is open"

    def _age(self, now: float) -> float:
        """Upper bound [s] of the age of what the gateway said last."""
        heard = None if self._state is None else self._state.heard
        return self._sent.age(None if heard is None else self._echoes.get((heard.boot, heard.sequence)), now)
