"""What the robot holds: by its program, or by an operator's word.

Nothing measures it and nothing stores it. After the agent's start nobody knows, and the body has all parts of the robot
file until an operator says which one is there: the gripper may have been emptied meanwhile, or filled.
"""

from collections.abc import Iterable


class HeldParts:
    """One part at most, while it is known."""

    def __init__(self) -> None:
        self._names: tuple[str, ...] | None = None
        self.held: tuple[str, ...] = ()
        """All that the gripper may hold."""
        self.known = True

    def declare(self, names: Iterable[str]) -> None:
        """The parts of the robot file, once it is read."""
        if self._names is None:
            self._names = self.held = tuple(names)
            self.known = not self.held

    def take(self, held: tuple[str, ...]) -> None:
        """From here on it holds this part, or none."""
        self.held, self.known = held, True

    @property
    def names(self) -> tuple[str, ...]:
        """Of all parts."""
        return self._names or ()

    @property
    def told(self) -> str | None:
        """The name of the part, empty for none; None where nobody knows."""
        return "".join(self.held) if self.known else None
