"""Inputs that an operator has forced: what WAIT DI and IF DI of this robot's programs see in place of what is measured.

Nobody else asks here. An input that switches a space is not forced, and what stops a robot is no named input.
"""

from collections.abc import Callable, Collection, Mapping

from cell.config.problem import near
from cell.messages import Severity


class NotForced(Exception):
    """An input stays as it is seen; the text says why, for people."""


class ForcedInputs:
    """Of one robot, until each follows again or the agent ends."""

    def __init__(
        self, robot: str, switching: Mapping[str, str], event: Callable[[Severity, str, str, str], None]
    ) -> None:
        """`switching`: by space, the input that switches it off; `event` notes severity, code, text and remedy."""
        self._robot = robot
        self._switching = switching
        self._event = event
        self.on: dict[str, bool] = {}
        """By name, what programs see."""

    def force(self, name: str, on: bool, known: Collection[str] | None) -> str:
        """From here on programs see it on, or off; `known` are all inputs, None while nobody has told them.

        Returns what is to be said. Raises `NotForced`.
        """
        if space := next((space for space, switches in self._switching.items() if switches == name), ""):
            raise NotForced(f"input {name} of {self._robot} switches space {space}: only its gateway says how it is")
        self._check(name, known)
        seen = f"programs of {self._robot} see input {name} {_word(on)}, whatever its gateway tells"
        if self.on.get(name) is on:
            return f"{seen}, as before"
        self.on[name] = on
        remedy = f"`cell input {self._robot} {name} follow` ends that"
        self._event(Severity.WARNING, "input_forced", seen, remedy)
        return f"{seen}; {remedy}"

    def follow(self, name: str, known: Collection[str] | None) -> str:
        """From here on programs see it as its gateway tells it. Returns what is to be said. Raises `NotForced`."""
        seen = f"programs of {self._robot} see input {name} as its gateway tells it"
        if name not in self.on:
            self._check(name, known)
            return f"{seen}, as before"
        del self.on[name]
        self._event(Severity.INFO, "input_follows", seen, "")
        return seen

    def end(self) -> None:
        """All follow: the agent is being stopped."""
        for name in tuple(self.on):
            self.follow(name, None)

    def _check(self, name: str, known: Collection[str] | None) -> None:
        if known is None:
            raise NotForced(f"the gateway of {self._robot} has not told its inputs yet: call again when it has")
        if name not in known:
            none = "none: its drives file has no inputs for it"
            raise NotForced(f"unknown input {name!r} of {self._robot}, allowed {near(name, known, none)}")


def _word(on: bool) -> str:
    return "on" if on else "off"
