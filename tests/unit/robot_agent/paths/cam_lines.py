"""Programs as CAM systems write them, and an oracle that says how far a path is from one."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation, Slerp

from robot_agent.paths import Line
from robot_agent.paths.caps import Tolerance
from robot_agent.paths.pose_path import PosePath

Numbers = NDArray[np.float64]

_STEP = 0.2
_LOOKED_AT = 300
KINDS = ("circle", "wave", "face", "text", "corners", "doubled", "specks", "reversals", "mixed", "axes", "turning")


@dataclass(frozen=True)
class CamLines:
    """Places `(n + 1, 3)` [m] and orientations of the vertices, the first where the robot is."""

    places: Numbers
    rotations: Rotation

    def lines(self, tolerance: Tolerance | None, speed_m_s: float = 0.1) -> list[Line]:
        """One move to each vertex after the first."""
        return [Line(pose, speed_m_s, k + 1, tolerance=tolerance) for k, pose in enumerate(self.poses[1:])]

    @property
    def poses(self) -> Numbers:
        """`(n + 1, 4, 4)`"""
        poses = np.tile(np.eye(4), (len(self.places), 1, 1))
        poses[:, :3, :3], poses[:, :3, 3] = self.rotations.as_matrix(), self.places
        return poses

    def sampled(self, step_m: float) -> tuple[Numbers, Rotation]:
        """Places and orientations along the lines, not farther apart than so much."""
        length = np.linalg.norm(np.diff(self.places, axis=0), axis=1)
        turn = (self.rotations[:-1].inv() * self.rotations[1:]).magnitude()
        counts = np.ceil(np.maximum(length / step_m, turn / 1e-3)).astype(int) + 1
        at = np.append(0.0, np.concatenate([k + np.arange(1, n + 1) / n for k, n in enumerate(counts)]))
        places = np.stack([np.interp(at, np.arange(len(self.places)), each) for each in self.places.T], axis=1)
        return places, Slerp(np.arange(len(self.places)), self.rotations)(at)


def cam_lines(kind: str, rng: np.random.Generator) -> CamLines:
    """Some 20 to 60 lines of a kind, by chance."""
    step = float(rng.choice([5e-5, 1e-4, 5e-4, 1e-3]))
    s = np.arange(int(rng.integers(20, 60))) * step
    radius = float(rng.choice([1e-3, 5e-3, 0.05]))
    circle = radius * np.stack([np.cos(s / radius), np.sin(s / radius), 0.0 * s], axis=1)
    wave = np.stack([s, 0.3 * radius * np.sin(s / radius), 0.1 * s], axis=1)
    turn = np.zeros((len(s), 3))
    match kind:
        case "circle":
            places = circle
        case "wave" | "turning":
            places = wave
            if kind == "turning":
                turn = np.stack([0.2 * np.sin(s / radius), 0.3 * np.cos(s / radius), 5.0 * s], axis=1)
        case "face":
            places = np.stack([s, 0.0 * s, 0.0 * s], axis=1) + 1e-6 * rng.standard_normal((len(s), 3))
        case "text":
            places = np.concatenate([circle, circle[-1] + np.outer(np.arange(1, 20) * step, [1.0, 0.0, 0.2])])
            turn = np.outer(np.arange(len(places)), rng.normal(size=3)) * 2e-3
        case "corners":
            ways = rng.normal(size=(6, 3))
            places = np.concatenate([[np.zeros(3)], np.cumsum(np.repeat(0.2 * step * ways, 10, axis=0), axis=0)])
            turn = np.zeros((len(places), 3))
        case "doubled":
            places = np.repeat(wave, rng.integers(1, 4, len(wave)), axis=0)
            turn = np.zeros((len(places), 3))
        case "specks":
            places = wave + np.where(rng.random((len(s), 1)) < 0.5, 0.0, 1.0) * 5e-8 * rng.standard_normal((len(s), 3))
            places = np.repeat(places, 2, axis=0) + 5e-8 * rng.standard_normal((2 * len(s), 3))
            turn = np.zeros((len(places), 3))
        case "reversals":
            back = np.concatenate([s, s[-1] - s[: len(s) // 2], s])
            places, turn = np.stack([back, 0.0 * back, 0.0 * back], axis=1), np.zeros((len(back), 3))
        case "mixed":
            ways = rng.choice([1e-4, 1e-3, 5e-3], size=(40, 1)) * (
                np.array([1.0, 0, 0]) + 0.1 * rng.normal(size=(40, 3))
            )
            places, turn = np.cumsum(ways, axis=0), np.zeros((40, 3))
        case "axes":
            ways = np.repeat(np.eye(3)[rng.integers(0, 3, 8)] * rng.choice([-1, 1], size=(8, 1)), 5, axis=0) * step
            places, turn = np.concatenate([[np.zeros(3)], np.cumsum(ways, axis=0)]), np.zeros((41, 3))
    return CamLines(places, Rotation.from_rotvec(turn) * Rotation.from_euler("y", 90, degrees=True))


def away(lines: CamLines, paths: list[PosePath], tolerance: Tolerance) -> float:
    """How far paths and lines are from each other at most, both ways, as a share of the tolerance.

    Some 300 places of each are looked at, and all places of the other `_STEP` of the tolerance apart, which makes up to
    0.5 % of a difference. Near to each there has to be one that is within both tolerances.
    """
    step = _STEP * tolerance.distance_m
    places, rotations = lines.sampled(step)
    poses = np.concatenate([path.poses(_distances(path, step)) for path in paths])
    one, other = (places, rotations.as_quat()), (poses[:, :3, 3], Rotation.from_matrix(poses[:, :3, :3]).as_quat())
    return max(_farthest(*one, *other, tolerance), _farthest(*other, *one, tolerance))


def _distances(path: PosePath, step_m: float) -> Numbers:
    if np.linalg.norm(path.chain.at(np.zeros(1))[1]) == 0.0:
        step_m = 1e-3  # on the spot it is an angle
    spin = path.orientation.states(np.linspace(0.0, path.length_m, 200))[1]
    step_m = min(step_m, 1e-3 / max(float(np.linalg.norm(spin, axis=1).max()), 1e-9))
    return np.linspace(0.0, path.length_m, int(np.ceil(path.length_m / step_m)) + 2)


def _farthest(places: Numbers, q: Numbers, others: Numbers, beside: Numbers, tolerance: Tolerance) -> float:
    looked_at = np.unique(np.linspace(0, len(places) - 1, _LOOKED_AT).astype(int))
    near = KDTree(others).query_ball_point(places[looked_at], 1.1 * tolerance.distance_m)
    worst = 0.0
    for k, found in zip(looked_at, near, strict=True):
        if not found:
            return float("inf")
        far = np.linalg.norm(others[found] - places[k], axis=1) / tolerance.distance_m
        cosine = np.minimum(np.abs(beside[found] @ q[k]), 1.0)
        turned = 2.0 * np.arctan2(np.sqrt(1.0 - cosine**2), cosine) / tolerance.angle_rad
        worst = max(worst, float(np.maximum(far, turned).min()))
    return worst
