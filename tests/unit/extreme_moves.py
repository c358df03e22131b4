"""Programs at the extremes: moves of nanometres, turns there and back, tight and wide edges, creeping speeds."""

import numpy as np

from cell.geometry import from_xyz_abc
from robot_agent.kinematics import Model
from robot_agent.paths import Arc, JointMove, Line, Move, Sequence, Spline

ROOM_M = {"six_axis": 0.1, "cobot": 0.04, "scara": 0.02, "palletizer": 0.1, "delta": 0.03, "gantry": 0.1}
_EDGES_M = [None, None, 0.0, 1e-7, 1e-5, 1e-4, 1e-3, 0.01, 0.05, 0.5]
_WAYS_M = [1e-9, 5e-8, 2e-7, 1e-6, 1.1e-6, 3e-6, 2e-5, 1e-4, 1e-3, 0.01, 0.05]


class _Drawing:
    """One program: where it is, and what is drawn next."""

    def __init__(self, model: Model, start: np.ndarray, seed: int) -> None:
        self.rng = np.random.default_rng([seed, 3])
        self.model, self.start, self.room_m = model, start, ROOM_M[model.description.family]
        self.home = self.pose = model.forward(start)
        self.poses = [self.pose]
        self.slow = self.rng.uniform() < 0.2

    def pose_next(self) -> np.ndarray:
        """A tiny or a large step, a round one, one turned, or a place where the program was before."""
        if self.rng.uniform() < 0.25:
            self.pose = self.poses[self.rng.integers(len(self.poses))].copy()
            return self.pose
        made = self.pose.copy()
        way_m = min(float(self.rng.choice(_WAYS_M)), self.room_m)
        direction = self.rng.normal(size=3) if self.rng.uniform() < 0.5 else self.rng.choice([-1.0, 0.0, 1.0], 3)
        made[:3, 3] += way_m * direction / max(float(np.linalg.norm(direction)), 1.0)
        if np.abs(made[:3, 3] - self.home[:3, 3]).max() > self.room_m:
            made[:3, 3] = self.home[:3, 3] + self.room_m * self.rng.choice([-0.5, 0.0, 0.5], 3)
        if self.rng.uniform() < 0.4:
            made[:3, :3] = self._turn() @ made[:3, :3]
        self.pose = made
        self.poses.append(made)
        return made

    def _turn(self) -> np.ndarray:
        angles = np.zeros(6)
        angle = self.rng.choice([1e-9, 1e-7, 1e-5, 1e-3, 0.05, 0.3]) * self.rng.choice([-1.0, 1.0])
        angles[self.rng.integers(3, 6) if self.model.n == 6 else 5] = angle
        return np.asarray(from_xyz_abc(angles)[:3, :3])

    def caps(self) -> dict[str, float | None]:
        """An edge, and caps that are often there, some of them creeping."""
        speed = self.rng.choice([0.005, 0.02] if self.slow else [0.05, 0.2, 1.0])
        sometimes = {"rotation_rad_s": float(np.exp(self.rng.uniform(-3.0, 1.0))), "speed_m_s": float(speed)}
        if self.rng.uniform() < 0.1:
            sometimes["joint_speed_rad_s"] = float(np.exp(self.rng.uniform(-2.0, 1.0)))
        made: dict[str, float | None] = {name: value for name, value in sometimes.items() if self.rng.uniform() < 0.5}
        return {"speed_m_s": None, "round_m": _EDGES_M[self.rng.integers(len(_EDGES_M))], **made}

    def move(self, line: int) -> Move:
        caps, kind = self.caps(), self.rng.uniform()
        if kind < 0.75:
            return Line(self.pose_next(), line=line, **caps)  # type: ignore[arg-type]
        if kind < 0.8:
            return Arc(self.pose_next(), self.pose_next(), line, **caps)  # type: ignore[arg-type]
        if kind < 0.87:
            points = np.array([self.pose_next() for _ in range(self.rng.integers(1, 4))])
            return Spline(points, line, **caps)  # type: ignore[arg-type]
        step = self.rng.choice([1e-9, 1e-6, 1e-3, 0.05]) * self.rng.choice([-1.0, 0.0, 1.0], self.model.n)
        target = self.start + np.where(self.model.linear, 0.2 * step, step)
        self.pose = self.model.forward(target)
        self.poses.append(self.pose)
        return JointMove(target, 1.0, line, **caps)  # type: ignore[arg-type]


def extreme_sequence(model: Model, start: np.ndarray, seed: int, longest: int = 6) -> Sequence:
    """Moves at the extremes around joints `start` `(n,)`."""
    drawing = _Drawing(model, start, seed)
    return Sequence([drawing.move(line) for line in range(1, int(drawing.rng.integers(2, longest + 1)) + 1)])
