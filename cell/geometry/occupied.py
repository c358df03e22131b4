"""Whether the space that a robot may occupy touches a box: the one rule that manager and agents share."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cell.geometry.box import Box, any_capsule_touches_box, point_box_distance


class OccupiedSpace(Protocol):
    """What the rule needs to know of a robot's published body (`cell.messages.Body`)."""

    @property
    def known(self) -> bool: ...
    @property
    def base(self) -> tuple[float, float, float]: ...
    @property
    def reach_m(self) -> float: ...
    @property
    def radii_m(self) -> NDArray[np.float32]: ...
    @property
    def poses(self) -> NDArray[np.float32]: ...
    @property
    def growth_m(self) -> NDArray[np.float32]: ...


def body_touches_box(body: OccupiedSpace, box: Box) -> bool:
    """True when any capsule of any pose, grown by that pose's growth, touches the box.

    A body that is not known, or has no poses, counts as its whole reach: a sphere around its base.
    """
    if not body.known or len(body.poses) == 0:
        return float(point_box_distance(np.array(body.base), box)) <= body.reach_m
    grown = body.radii_m + body.growth_m[:, None].astype(float)
    return any_capsule_touches_box(body.poses.astype(float), grown, box)
