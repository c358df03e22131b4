"""What geometry refuses."""


class GeometryError(ValueError):
    """Root of all errors of `cell.geometry`."""


class WrongShape(GeometryError):
    """An array has not the shape that a function works on."""

    def __init__(self, what: str, found: tuple[int, ...], allowed: str) -> None:
        self.what = what
        self.found = found
        self.allowed = allowed
        super().__init__(f"{what}: found shape {found}, allowed {allowed}")


class NotAPose(GeometryError):
    """A matrix is not a rigid motion. `index` addresses it in the batch (empty for a single matrix)."""

    def __init__(self, what: str, index: tuple[int, ...], defect: str) -> None:
        self.what = what
        self.index = index
        self.defect = defect
        where = f"{what}[{', '.join(map(str, index))}]" if index else what
        super().__init__(
            f"{where}: {defect}; allowed is a right-handed rotation (R R^T = I, det R = 1) with a finite position; "
            "build poses with cell.geometry.pose or normalise the rotation first"
        )


class NoFrame(GeometryError):
    """Measured points that determine no frame. `index` addresses them in the batch (empty for a single frame)."""

    def __init__(self, index: tuple[int, ...], defect: str, advice: str) -> None:
        self.index = index
        self.defect = defect
        where = f"points[{', '.join(map(str, index))}]" if index else "points"
        super().__init__(f"{where}: {defect}; {advice}")
