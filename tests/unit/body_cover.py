"""Whether a published body covers points."""

import numpy as np

from cell.messages import Body


def covers(body: Body, points: np.ndarray, beside_m: float = 1e-9) -> bool:
    """Whether each capsule `(c, 2, 3)` [m] lies in some pose of the body, grown as it says and by `beside_m`.

    With the TCP as one more, of length 0, whether that does too.
    """
    poses = body.poses
    if len(points) > poses.shape[1]:
        poses = np.concatenate([poses, np.repeat(body.tcp_m[:, None, None], 2, axis=2)], axis=1)
    away = np.linalg.norm(poses - points, axis=-1).max(axis=-1)
    return bool((away <= body.growth_m[:, None].astype(float) + beside_m).any(axis=0).all())
