"""A ball as a mesh, which is easily compared with a sphere."""

from pathlib import Path

import numpy as np

_ACROSS, _AROUND = 72, 72
_RADIUS_MM = 100.0


def ball_file(folder: Path) -> Path:
    """An OBJ file of more than 10 000 triangles: a closed ball of 100 mm radius, in mm."""
    lon = np.linspace(0, 2 * np.pi, _ACROSS, endpoint=False)
    lon, lat = np.meshgrid(lon, np.linspace(0.0, np.pi, _AROUND))
    ball = _RADIUS_MM * np.stack([np.sin(lat) * np.cos(lon), np.sin(lat) * np.sin(lon), np.cos(lat)], axis=-1)
    quads = [
        (r * _ACROSS + c, r * _ACROSS + (c + 1) % _ACROSS, (r + 1) * _ACROSS + (c + 1) % _ACROSS, (r + 1) * _ACROSS + c)
        for r in range(_AROUND - 1)
        for c in range(_ACROSS)
    ]
    ball = np.round(ball, 9)  # all corners at a pole are one
    faces = [f"f {a + 1} {b + 1} {c + 1}\nf {a + 1} {c + 1} {d + 1}" for a, b, c, d in quads]
    file = folder / "ball.obj"
    file.write_text("\n".join([f"v {x} {y} {z}" for x, y, z in ball.reshape(-1, 3)] + faces) + "\n")
    return file
