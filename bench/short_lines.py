"""Programs of ten thousand short lines within a tolerance: feed, planning, and what is kept of an endless one."""

import pickle
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.timing import Row
from robot_agent.agent.planning.lookahead import Lookahead
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Extended, Plan, Planned
from robot_agent.kinematics import Model, load_model
from robot_agent.language import Finished, Names, mounted_before, parse_program
from robot_agent.workspace import PlacedRobot

Numbers = NDArray[np.float64]

_MODEL = Path(__file__).parents[1] / "cell_configs" / "models" / "six_axis.yaml"
_CYCLE_S, _LOOK_S = 0.004, 0.02
_LINES, _MANY = 10_000, 100_000
_BEGIN = "MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0\n"
_PLACE_MM = np.array([1023.6, 0.0, 1413.1])
_STOPPING = 60
_SPLINE_MM = 4.0


@dataclass(frozen=True)
class Geometry:
    """A curve by its way [mm]: places `(k, 3)` [mm] and A, B, C `(k, 3)` [deg]; and how a person programs it."""

    name: str
    poses: Callable[[Numbers], tuple[Numbers, Numbers]]
    smooth: Callable[[float, float], str]
    """Of so much way [mm] at a feed [mm/s]: arcs, splines or long lines."""


def _still(places: Numbers) -> tuple[Numbers, Numbers]:
    return places, np.tile([0.0, 90.0, 0.0], (len(places), 1))


def _circle(way: Numbers) -> tuple[Numbers, Numbers]:
    turn = way / 50.0
    return _still(np.stack([0.0 * way, 50.0 * np.sin(turn), 50.0 * (1.0 - np.cos(turn))], axis=1))


def _as_arc(way: float, feed: float) -> str:
    places = _PLACE_MM + _circle(np.array([25.0, 50.0]))[0]
    via, target = (
        " ".join(f"{q}{n}={x:.6f}" for n, x in zip("XYZ", p, strict=True))
        for q, p in zip(("Q", ""), places, strict=True)
    )
    return f"MC {via} {target} H={np.degrees(way / 50.0):.6f} F={feed}\n"


def _wave(way: Numbers) -> tuple[Numbers, Numbers]:
    along = np.linspace(0.0, 1.2 * way.max() / 100.0, 40_000)
    places = np.stack([3.0 * np.sin(15.0 * along), 100.0 * np.sin(along), 40.0 * np.sin(2.0 * along)], axis=1)
    return _still(_by_way(places, way))


def _face(way: Numbers) -> tuple[Numbers, Numbers]:
    rows = np.arange(1 + int(way.max() // 101.0) + 1)
    corners = np.repeat(rows, 2)[:, None] * [0.0, 0.0, 1.0] + np.resize([0.0, 100.0, 100.0, 0.0], 2 * len(rows))[
        :, None
    ] * [0.0, 1.0, 0.0]
    noise = 1e-3 * np.random.default_rng(1).standard_normal((len(way), 3))
    return _still(_by_way(corners, way) + noise)


def _text(way: Numbers) -> tuple[Numbers, Numbers]:
    along = np.linspace(0.0, 2.0 * way.max() / 40.0, 60_000)
    places = np.stack([5.0 * np.cos(along), 40.0 * np.sin(along), 25.0 * np.sin(2.0 * along)], axis=1)
    at = _by_way(np.column_stack([places, along]), way)
    turns = np.stack(
        [5.0 * np.sin(at[:, 3]), 90.0 + 6.0 * np.cos(at[:, 3]) - 6.0, 4.0 * np.sin(2.0 * at[:, 3])], axis=1
    )
    return at[:, :3] - places[0], turns


def _by_way(curve: Numbers, way: Numbers) -> Numbers:
    """Columns of a polyline, the first three a place, at ways `(k,)` along it."""
    known = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(curve[:, :3], axis=0), axis=1)))
    return np.stack([np.interp(way, known, each) for each in curve.T], axis=1)


def _lines(poses: tuple[Numbers, Numbers], word: str, feed: float) -> str:
    moves = np.hstack([_PLACE_MM + poses[0], poses[1]])
    first = f" F={feed}"
    made = []
    for row in moves.tolist():
        words = "{} X={:.4f} Y={:.4f} Z={:.4f} A={:.4f} B={:.4f} C={:.4f}".format(word, *row)
        made.append(words + first)
        first = ""
    return "\n".join(made) + "\n"


def _as_spline(geometry: Callable[[Numbers], tuple[Numbers, Numbers]]) -> Callable[[float, float], str]:
    return lambda way, feed: _lines(geometry(np.linspace(0.0, way, round(way / _SPLINE_MM) + 1)[1:]), "MS", feed)


def _as_long_lines(way: float, feed: float) -> str:
    ends = np.append(np.add.outer(101.0 * np.arange(int(way // 101.0)), [100.0, 101.0]).ravel(), way)
    places = np.round(_face(ends)[0])
    return _lines(_still(places), "ML", feed)


GEOMETRIES = (
    Geometry("circle of 50 mm", _circle, _as_arc),
    Geometry("wave", _wave, _as_spline(_wave)),
    Geometry("face with 1 um of noise", _face, _as_long_lines),
    Geometry("3-D loops with orientation", _text, _as_spline(_text)),
)


@dataclass
class Ran:
    """A program as the agent runs it: what motion and planning take [s], and the bytes of the largest plan."""

    motion_s: float = 0.0
    planning_s: float = 0.0
    plans: int = 0
    kept: int = 0


def ran(model: Model, text: str) -> Ran:
    """Read, planned and extended as by the agent, while the robot moves on. Planning is counted in processor time."""
    program, planner, result = parse_program(_BEGIN + text, "cam", Names(model.joint_names)), _planner(model), Ran()
    lookahead = Lookahead()
    lookahead.start(program, np.asarray(model.home), mounted_before(program, model.description))
    now = 0.0

    def planned(request: Plan) -> Planned:
        nonlocal now
        begun = time.process_time()
        made = planner.plan(request.request)
        took = time.process_time() - begun
        assert isinstance(made, Planned), made
        now += took
        result.planning_s += took
        result.plans += 1
        result.kept = max(result.kept, len(pickle.dumps(made)))
        return made

    while True:
        begun = time.process_time()
        effects = lookahead.fill((), now)
        result.planning_s += time.process_time() - begun
        for effect in effects:
            if isinstance(effect, Plan):
                lookahead.planned(planned(effect), now)
        head = lookahead.head
        if isinstance(head, Finished):
            return result
        if not isinstance(head, Planned):
            continue
        tau = 0.0
        while lookahead.open is head:
            tau += _LOOK_S
            begun = time.process_time()
            effects = lookahead.extend((tau, tau), tau, (), now)
            result.planning_s += time.process_time() - begun
            for effect in effects:
                if isinstance(effect, Plan):
                    extended, before = planned(effect), now
                    assert isinstance(extended, Extended)
                    lookahead.extended(extended, taken=True, now=before)
                    head, tau = extended, tau - extended.cut_s
                    result.motion_s += extended.cut_s
        result.motion_s += head.motion.duration_s
        lookahead.advance()


def _planner(model: Model) -> Planner:
    return Planner(PlacedRobot.at(model), _CYCLE_S)


def short_lines() -> list[Row]:
    """For each geometry, length of the lines and feed."""
    model = load_model(_MODEL)
    rows = []
    for geometry in GEOMETRIES:
        for line_mm in (0.5, 0.1):
            for feed in (100.0, 300.0):
                rows += _rows(model, geometry, line_mm, feed)
    return [*rows, *_memory(model)]


def _rows(model: Model, geometry: Geometry, line_mm: float, feed: float) -> list[Row]:
    way = _LINES * line_mm
    poses = geometry.poses(line_mm * np.arange(1.0, _LINES + 1.0))
    lines = _lines(poses, "ML", feed)
    short, smooth = ran(model, "TOL 0.05\n" + lines), _alone_s(model, geometry.smooth(way, feed))
    stopping = _alone_s(model, "".join(lines.splitlines(keepends=True)[:_STOPPING])) * _LINES / _STOPPING
    name = f"{_LINES} lines of {line_mm} mm, {geometry.name}, F={feed:g}"
    beside = f"of its feed as arcs and splines (aim 0.9); stopping at each line takes {stopping:.0f} s"
    share = short.planning_s / short.motion_s
    return [
        Row(f"{name}: motion", short.motion_s, smooth / short.motion_s, beside),
        Row(f"{name}: a line planned", short.planning_s / _LINES, share, "of the motion's time (aims 1 ms, 0.5)"),
    ]


def _alone_s(model: Model, text: str) -> float:
    """What a program takes that is planned at once."""
    return ran(model, text).motion_s


def _memory(model: Model) -> list[Row]:
    kept = []
    for count in (_MANY // 2, _MANY):  # both longer than what is kept behind the robot
        poses = _circle(0.1 * np.arange(1.0, count + 1.0))
        kept.append(ran(model, "TOL 0.05\n" + _lines(poses, "ML", 300.0)))
    few, many = kept
    what = f"{_MANY} lines of 0.1 mm, F=300: a line planned"
    beside = f"of the largest plan kept with half of them ({few.kept / 1e6:.1f} MB)"
    return [Row(what, many.planning_s / _MANY, many.kept / few.kept, beside)]
