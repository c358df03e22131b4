"""Why moves make no path."""


class PathError(Exception):
    """Geometry that does not exist. `block` counts the blocks of the sequence from 0."""

    def __init__(self, block: int, reason: str, hint: str) -> None:
        self.block = block
        self.reason = reason
        self.hint = hint
        super().__init__(f"block {block}: {reason}; {hint}")
