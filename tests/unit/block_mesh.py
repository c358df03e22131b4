"""A box as a mesh, and a mesh as a file."""

from pathlib import Path

import numpy as np


def block(
    size: tuple[float, float, float], at: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> tuple[np.ndarray, np.ndarray]:
    """Corners `(8, 3)` and triangles `(12, 3)`, which go around counter-clockwise as seen from outside."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(size) / 2.0
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners + np.array(at), np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])


def obj_file(file: Path, corners: np.ndarray, triangles: np.ndarray) -> Path:
    """The file, written."""
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles]
    file.write_text("\n".join(lines) + "\n")
    return file
