"""Planning programs by chance, with every robot model that is shipped."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bench.timing import Row
from cell.geometry import from_xyz_abc
from cell.geometry.arrays import Array
from robot_agent.kinematics import load_model
from robot_agent.paths import Arc, Line, Move, Sequence, Spline
from robot_agent.trajectory import Limits, PlanError, plan

MODELS = Path(__file__).parents[1] / "cell_configs" / "models"
MOVES, PROGRAMS, MOST_TRIES = 24, 9, 60
SPEED_M_S, ROUND_M = 0.5, 0.03
ALLOWED_S = 0.2
"""What the project promises, in the median of programs."""


@dataclass(frozen=True, slots=True)
class _Place:
    """Where the moves of a family are drawn."""

    beside_home: tuple[float, ...]
    """The first pose, by joints [rad or m]."""
    size_m: float
    """Poses lie at most so far from it along each axis."""
    turns: tuple[float, float, float]
    """And are turned by at most these shares of `_TURN` in A, B and C."""


_TURN = 0.2
"""[rad]"""
_ALL, _UPRIGHT = (1.0, 1.0, 1.0), (0.0, 0.0, 1.0)
_PLACES = {
    "six_axis": _Place((0.0,) * 6, 0.14, _ALL),
    "cobot": _Place((0.0,) * 6, 0.05, _ALL),
    "scara": _Place((0.0, 0.0, -0.05, 0.0), 0.02, _UPRIGHT),
    "palletizer": _Place((0.0,) * 4, 0.12, _UPRIGHT),
    "delta": _Place((0.26, 0.26, 0.26, 0.0), 0.04, _UPRIGHT),
    "gantry": _Place((0.0,) * 6, 0.12, _ALL),
    "painter": _Place((0.0,) * 6, 0.1, _ALL),
}


def random_moves() -> Iterator[Row]:
    """Planning lines, arcs and splines with round edges: processor time, the median of nine programs within reach."""
    for family, place in _PLACES.items():
        planning_s = float(np.median(list(_taken(family, place))))
        yield Row(
            f"plan {MOVES} random moves, {family} (processor time)",
            planning_s,
            planning_s / ALLOWED_S,
            f"of {1e3 * ALLOWED_S:g} ms",
        )


def _taken(family: str, place: _Place) -> Iterator[float]:
    model = load_model(MODELS / f"{family}.yaml")
    limits, start = Limits.of(model.description), model.home + place.beside_home
    planned = 0
    for seed in range(MOST_TRIES):
        program = Sequence(_moves(model.forward(start), place, np.random.default_rng(seed)))
        begin = time.process_time()
        try:
            plan(model, program, limits, start=start)
        except PlanError:  # out of reach
            continue
        yield time.process_time() - begin
        planned += 1
        if planned == PROGRAMS:
            return


def _moves(first: Array, place: _Place, rng: np.random.Generator) -> list[Move]:
    def pose() -> Array:
        made = first.copy()
        made[:3, 3] += rng.uniform(-place.size_m, place.size_m, 3)
        turns = rng.uniform(-_TURN, _TURN, 3) * place.turns
        made[:3, :3] = from_xyz_abc(np.concatenate([np.zeros(3), turns]))[:3, :3] @ first[:3, :3]
        return made

    moves: list[Move] = []
    for number, kind in enumerate(rng.integers(0, 3, MOVES).tolist(), 1):
        if kind == 0:
            moves.append(Line(pose(), SPEED_M_S, number, round_m=ROUND_M))
        elif kind == 1:
            moves.append(Arc(pose(), pose(), number, speed_m_s=SPEED_M_S, round_m=ROUND_M))
        else:
            moves.append(Spline(pose()[None], number, SPEED_M_S))
    return moves
