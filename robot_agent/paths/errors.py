"""Why moves make no path."""


class PathError(Exception):
    """Geometry that does not exist. `move` counts the moves of the sequence from 0."""

    def __init__(self, move: int, reason: str, hint: str) -> None:
        self.move = move
        self.reason = reason
        self.hint = hint
        super().__init__(f"move {move}: {reason}; {hint}")
