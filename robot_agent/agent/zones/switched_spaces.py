"""Which spaces of the robot are off now: those that its program has switched off, and those with a closed input."""

from collections.abc import Mapping

from robot_agent.agent.zones.gateway_signals import GatewaySignals


class SwitchedSpaces:
    """What may be off counts as on unless the contrary is known and young."""

    def __init__(self, inputs: Mapping[str, str], signals: GatewaySignals) -> None:
        """`inputs`: by space, the input that switches it off."""
        self._inputs = inputs
        self._signals = signals
        self.by_program: frozenset[str] = frozenset()
        """What the program has switched off."""

    def off(self, now: float) -> frozenset[str]:
        """The spaces that are off."""
        return self.by_program.union(space for space in self._inputs if not self.why_on(space, now))

    def why_on(self, space: str, now: float) -> str:
        """Why a space is on that an input switches, for people; empty while it is off."""
        name = self._inputs[space]
        if why := self._signals.why_unknown(name, now):
            return f"space {space}: {why}"
        return "" if self._signals.closed(name, now) else f"space {space}: input {name} is open"
