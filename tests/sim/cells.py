"""Generated cells: robots of several families around zones that they contend for, and programs for them.

The same seed gives the same cell. What is drawn passes `cell check`; a cell whose robots never ask for one zone at
overlapping times is drawn again. In a room these zones are left out of the cell in the end, and the manager keeps the
robots apart that go there.
"""

import atexit
import itertools
import math
import random
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from cell.commands.checks import CellBundle, check_cell
from cell.geometry import capsule_distance, transform_points
from cell.geometry.arrays import Array, Flags
from robot_agent.agent.planning.dry_run import dry_run
from robot_agent.agent.planning.planner import Planner
from robot_agent.language import Names, parse_program
from tests.sim.programs import APPROACHES, Way, program_text
from tests.sim.volume import Volume

MODELS = Path(__file__).parents[2] / "cell_configs" / "models"
_MOST_DRAWS = 600
_OF, _ROOM, _ROW = 8, 5, 7
"""Of eight cells, which is a room and which a row of three to six robots."""
_SHORTER_AFTER = 150
"""A row has one robot less after so many draws that are refused."""
_LONGEST_S = 9.0
"""Of motion, of a program; twice as long in a row, where robots visit two zones."""
_ASKED_S = 0.6
"""So long before it enters a zone a robot asks for it."""
_KEPT_APART = 0.4
"""Share of the other cells that keep their robots apart, where these are so much farther apart than the margin at home:
"""
_ROOM_MM = 60.0
_NARROW = 0.6
"""There zones are so much narrower: who has passed one is in the way of those who wait on its other side."""
_ZONE_MIDDLE_MM, _ZONE_HEIGHT_MM = 1400.0, 2600.0
_TOP_MM = _ZONE_MIDDLE_MM + _ZONE_HEIGHT_MM / 2
_SIDES = {"-x": 0.0, "+x": 180.0, "-y": 90.0, "+y": -90.0}
"""Of a zone, and in which direction [deg] a robot that stands there looks at it."""


@dataclass(frozen=True, slots=True)
class _Zone:
    name: str
    x: float
    y: float
    half_x: float
    half_y: float
    turn: float
    """[deg] about Z, of the box with all who stand around it."""


@dataclass(frozen=True, slots=True)
class _Robot:
    name: str
    family: str
    x: float
    y: float
    z: float
    turn: float
    ways: tuple[Way, ...]


@dataclass(frozen=True, slots=True)
class GeneratedCell:
    """A cell, and what is known of it before anything runs."""

    number: int
    bundle: CellBundle
    families: tuple[str, ...]
    cycle_s: tuple[float, ...]
    longest_s: float
    """Of the programs, each by itself."""


@lru_cache(maxsize=4)
def generated_cell(number: int) -> GeneratedCell:
    """The cell with this number."""
    for draw in range(_MOST_DRAWS):
        cell = _drawn(number, random.Random(f"cell {number}, draw {draw}"), _links(number, draw))
        if cell is not None:
            return cell
    raise AssertionError(f"cell {number}: no cell with contention in {_MOST_DRAWS} draws")


def _drawn(number: int, rng: random.Random, links: int) -> GeneratedCell | None:
    margin_mm = _margin_mm(number)
    narrow = 1.0 if margin_mm is None else _NARROW
    zones, robots = _chain(rng, narrow, links) if links else _layout(rng, narrow)
    texts = {robot.name: program_text(rng, robot.family, robot.ways) for robot in robots}
    folder = _folder(number)
    for robot in robots:
        (folder / f"{robot.name}.prog").write_text(texts[robot.name])
    gateways = _gateways(rng, robots)
    lag_s = rng.choice([0.008, 0.02])
    overrun_s, lost_s = rng.choice([(0.5, 0.8), (0.06, 0.25), (0.06, 0.25)])
    cycles = {name: rng.choices([0.02, 0.01, 0.004 if len(robots) == 2 else 0.02], [12, 3, 1])[0] for name in gateways}
    for name, members in gateways.items():
        (folder / f"{name}.yaml").write_text(_drives(rng, name, members, cycles[name], overrun_s))
        (folder / f"{name}.sim.yaml").write_text(f"units: {{length: mm, angle: deg}}\nlag_s: {lag_s}\n")
    text = _cell(rng, zones, robots, gateways, lost_s, max(cycles.values()))
    (folder / "cell.yaml").write_text(f"{text}separation: off\n")
    bundle, _ = check_cell(folder / "cell.yaml")
    if bundle is None:
        return None
    worth = _contention(bundle, _LONGEST_S * (2.0 if links else 1.0))
    if worth is None:
        return None
    longest_s, paths = worth
    apart = margin_mm is not None and _rests_apart_m(paths) >= (margin_mm + _ROOM_MM) / 1000.0
    if is_room(number):
        if not apart or _least_m(paths) > 0.0:
            return None
        text = _without_zones(text)
    if apart and margin_mm is not None:
        bundle = _kept_apart(folder / "cell.yaml", text, margin_mm)
    families = tuple(robot.family for robot in robots)
    return GeneratedCell(number, bundle, families, tuple(cycles.values()), longest_s)


_FOLDERS: dict[int, tempfile.TemporaryDirectory[str]] = {}


def _folder(number: int) -> Path:
    """Of this process, and gone with it."""
    if number not in _FOLDERS:
        _FOLDERS[number] = tempfile.TemporaryDirectory(prefix=f"zencell_{number}_")
        atexit.register(_FOLDERS[number].cleanup)
    return Path(_FOLDERS[number].name)


# Who stands where


def _layout(rng: random.Random, narrow: float) -> tuple[list[_Zone], list[_Robot]]:
    shape = rng.choices(["pair", "two doors", "chain", "star", "long chain", "big"], [10, 2, 2, 3, 0.5, 0.5])[0]
    if shape == "pair":
        return _around(rng, narrow, ["-x", "+x"])
    if shape == "two doors":
        return _two_doors(rng, narrow)
    if shape == "star":
        return _around(rng, narrow, rng.choice([["-x", "+x", "top"], ["-x", "+x", "-y"], ["-x", "top"], ["-x", "-y"]]))
    if shape == "big":
        return _around(rng, narrow, ["-x", "+x", "-y", "+y"])
    return _chain(rng, narrow, 2 if shape == "chain" else rng.choice([3, 3, 4]))


def _links(number: int, draw: int) -> int:
    """Between robots in a row; 0 for another layout. Drawn anew each time, the long rows would hardly ever come."""
    if number % _OF != _ROW:
        return 0
    return max(2, random.Random(f"links {number}").choice([2, 3, 4, 5]) - draw // _SHORTER_AFTER)


def _family(rng: random.Random, side: str) -> str:
    if side == "top":
        return rng.choice(["gantry", "delta"])
    return rng.choice(["six_axis", "palletizer", "scara"])


def _around(rng: random.Random, narrow: float, sides: Sequence[str]) -> tuple[list[_Zone], list[_Robot]]:
    """One zone, and a robot at each of these sides."""
    wide = rng.uniform(420.0, 600.0) if "-y" in sides else rng.uniform(700.0, 1300.0)
    zone = _Zone("middle", 0.0, 0.0, narrow * rng.uniform(210.0, 450.0), wide, rng.choice([0.0, 0.0, 30.0, -17.0]))
    robots = []
    for number, side in enumerate(sides):
        family = _family(rng, side)
        robots.append(_at(rng, f"r{number}", family, zone, side))
    return [zone], robots


def _two_doors(rng: random.Random, narrow: float) -> tuple[list[_Zone], list[_Robot]]:
    """Two robots that face each other, and two zones side by side between them."""
    half_x, half_y = narrow * rng.uniform(210.0, 400.0), rng.uniform(150.0, 200.0)
    aside = half_y + rng.uniform(60.0, 200.0)
    zones = [_Zone("left", 0.0, aside, half_x, half_y, 0.0), _Zone("right", 0.0, -aside, half_x, half_y, 0.0)]
    robots = []
    for number, side in enumerate(["-x", "+x"]):
        family = rng.choice(["six_axis", "palletizer"])
        sign = 1.0 if side == "-x" else -1.0
        base_x = -sign * (half_x + APPROACHES[family].near_mm)
        ways = tuple(Way(zone.name, 0.0, sign * zone.y) for zone in zones)
        robots.append(_Robot(f"r{number}", family, base_x, 0.0, APPROACHES[family].base_z_mm, _SIDES[side], ways))
    return zones, robots


def _chain(rng: random.Random, narrow: float, links: int) -> tuple[list[_Zone], list[_Robot]]:
    """Robots in a row with a zone between each two; those in the middle turn from one to the other."""
    families = [_family(rng, "-x") for _ in range(links + 1)]
    zones: list[_Zone] = []
    robots: list[_Robot] = []
    x = 0.0
    for number, family in enumerate(families):
        near, ways = APPROACHES[family].near_mm, []
        if number > 0:
            x += near + zones[-1].half_x
            ways.append(Way(zones[-1].name, 90.0, 0.0))
        if number < links:
            half_x = narrow * rng.uniform(210.0, 400.0)
            zones.append(_Zone(f"z{number}", x + near + half_x, 0.0, half_x, rng.uniform(700.0, 1200.0), 0.0))
            ways.append(Way(zones[-1].name, -90.0, 0.0))
        robots.append(_Robot(f"r{number}", family, x, 0.0, APPROACHES[family].base_z_mm, 90.0, tuple(ways)))
        x = zones[-1].x
    return zones, robots


def _at(rng: random.Random, name: str, family: str, zone: _Zone, side: str) -> _Robot:
    approach, turn = APPROACHES[family], math.radians(zone.turn)
    if side == "top":
        (mx, my), z = approach.middle_mm, _TOP_MM - approach.near_mm
        at = zone.x - (math.cos(turn) * mx - math.sin(turn) * my), zone.y - (math.sin(turn) * mx + math.cos(turn) * my)
        return _Robot(name, family, at[0], at[1], z, zone.turn, (Way(zone.name, 0.0, 0.0),))
    half = zone.half_x if side.endswith("x") else zone.half_y
    away, looks = half + approach.near_mm, math.radians(_SIDES[side] + zone.turn)
    aside = 0.0 if rng.random() < 0.7 else rng.uniform(-100.0, 100.0)
    x, y = zone.x - away * math.cos(looks), zone.y - away * math.sin(looks)
    way = Way(zone.name, 0.0, aside)
    return _Robot(name, family, x, y, approach.base_z_mm, _SIDES[side] + zone.turn, (way,))


def _gateways(rng: random.Random, robots: Sequence[_Robot]) -> dict[str, list[_Robot]]:
    """One bus for each robot, or one for the first two."""
    if len(robots) > 2 and rng.random() < 0.3:
        return {"bus_0": list(robots[:2]), **{f"bus_{i}": [robot] for i, robot in enumerate(robots) if i > 1}}
    return {f"bus_{i}": [robot] for i, robot in enumerate(robots)}


# Files


def _cell(
    rng: random.Random,
    zones: Sequence[_Zone],
    robots: Sequence[_Robot],
    gateways: dict[str, list[_Robot]],
    lost_s: float,
    cycle_s: float,
) -> str:
    lines = ["cell: drawn", "units: {length: mm, angle: deg}", 'manager: {endpoint: "tcp/127.0.0.1:7450"}', "gateways:"]
    lines += [
        f'  {name}: {{endpoint: "tcp/127.0.0.1:{7451 + i}", drives: {name}.yaml}}' for i, name in enumerate(gateways)
    ]
    lines.append("robots:")
    for robot in robots:
        gateway = next(name for name, members in gateways.items() if robot in members)
        lines += [
            f"  {robot.name}:",
            f"    model: {MODELS / robot.family}.yaml",
            f"    gateway: {gateway}",
            f"    base: {{X: {robot.x:.1f}, Y: {robot.y:.1f}, Z: {robot.z:.1f}, A: 0, B: 0, C: {robot.turn:g}}}",
            f"    program: {robot.name}.prog",
        ]
    lines.append("zones:")
    for zone in zones:
        members = [robot.name for robot in robots if any(way.zone == zone.name for way in robot.ways)]
        lines += [
            f"  {zone.name}:",
            f"    size: [{2 * zone.half_x:.1f}, {2 * zone.half_y:.1f}, {_ZONE_HEIGHT_MM}]",
            f"    pose: {{X: {zone.x:.1f}, Y: {zone.y:.1f}, Z: {_ZONE_MIDDLE_MM}, A: 0, B: 0, C: {zone.turn:g}}}",
            f"    robots: [{', '.join(members)}]",
        ]
    fresh_s = rng.choice([0.25, 0.25, 0.25, 0.4, 0.7])
    owner_s, stop_s = rng.choice([0.15, 0.15, 0.5, 2.0]), rng.choice([1.2, 2.0])
    lead_s = max(0.032, 3.0 * cycle_s)
    times = f"fresh_s: {fresh_s}, feedback_lost_s: {lost_s}, owner_silent_s: {owner_s}, estop_delay_s: {stop_s}"
    idle = rng.choice(["", "", ", idle_off_s: 1.5"])
    lines.append(f"times: {{{times}, lead_s: {lead_s}{idle}}}")
    lines.append(f"on_manager_return: {rng.choice(['continue', 'continue', 'operator'])}")
    return "\n".join(lines) + "\n"


def _drives(rng: random.Random, name: str, robots: Sequence[_Robot], cycle_s: float, overrun_s: float) -> str:
    lines = [
        "units: {length: mm, angle: deg}",
        f"bus: {{interface: virtual, channel: {name}, bitrate: 1000000}}",
        f"cycle_s: {cycle_s}",
        f"overrun_limit_s: {overrun_s}",
        "heartbeat_producer_s: 0.1",
        f"heartbeat_timeout_s: {0.5 + overrun_s:g}",
        f"tpdo_timeout_s: {overrun_s + 0.1:g}",
        "boot_timeout_s: 5",
        "robots:",
    ]
    for number, robot in enumerate(robots):
        lines += [f"  {robot.name}:", "    axes:"]
        for axis, entry in APPROACHES[robot.family].axes.items():
            node = entry.partition("node: ")[2].partition(",")[0]
            shifted = entry.replace(f"node: {node},", f"node: {int(node) + 20 * number},", 1)
            lines.append(f"      {axis}: {{{shifted}, following_time_s: 0.1}}")
        last = list(APPROACHES[robot.family].axes)[-1]
        at_stop = rng.choice(["keep", "off"])
        lines += ["    outputs:", f"      gripper: {{axis: {last}, bit: 16, at_stop: {at_stop}}}"]
    return "\n".join(lines) + "\n"


# What it is worth


@dataclass(frozen=True, slots=True)
class _Path:
    """Where the body of a robot is along its program."""

    points: Array
    """`(m, c, 2, 3)` [m]."""
    radii: Array
    moves: Flags
    """`(c,)` whether the capsule is not of the base."""


def _contention(bundle: CellBundle, most_s: float) -> tuple[float, list[_Path]] | None:
    """How long the longest program lasts [s], and the paths; None unless two ask for one zone at overlapping times.

    None, too, for a program that lasts longer than `most_s`.
    """
    asked: dict[str, list[tuple[str, float, float]]] = {zone: [] for zone in bundle.cell.zones}
    longest_s, paths = 0.0, list[_Path]()
    for robot, settings in bundle.cell.robots.items():
        model = bundle.robots[robot].model
        text = settings.program.read_text()
        program = parse_program(
            text, settings.program.name, Names(model.joint_names, linear=model.linear_names, corrections={})
        )
        cycle_s = bundle.gateways[settings.gateway].cycle_s
        planner = Planner(bundle.robots[robot], cycle_s)
        motions, failed = dry_run(planner, program, 2.0 * most_s)
        lasts_s = sum(planned.motion.duration_s for planned in motions)
        if failed is not None or not motions or lasts_s > most_s:
            return None
        q = np.concatenate([planned.motion.q(np.arange(0.0, planned.motion.duration_s, 0.04)) for planned in motions])
        points = transform_points(planner.pose_world_base, model.capsules(q))
        paths.append(_Path(points, model.capsule_radii, np.array([each.link != 0 for each in model.body])))
        for zone in bundle.cell.zones.values():
            tcp = (planner.pose_world_base @ model.forward(q))[..., :3, 3]
            inside = Volume.at(zone).touched(points, model.capsule_radii, tcp)
            if inside[0] or (inside.any() and robot not in zone.robots):
                return None
            if robot in zone.robots and not inside.any():
                return None
            edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
            asked[zone.name] += [
                (robot, 0.04 * first - _ASKED_S, 0.04 * last) for first, last in edges.reshape(-1, 2).tolist()
            ]
        longest_s = max(longest_s, lasts_s)
    meets = any(
        one[0] != other[0] and one[1] < other[2] and other[1] < one[2]
        for visits in asked.values()
        for one in visits
        for other in visits
    )
    return (longest_s, paths) if meets else None


def is_room(number: int) -> bool:
    """Whether nothing but the manager's look at their bodies keeps the robots of this cell apart."""
    return number % _OF == _ROOM


def _margin_mm(number: int) -> float | None:
    """Some cells keep their robots apart; drawn by itself, so that the others are what they are."""
    rng = random.Random(f"separation {number}")
    margin_mm = rng.choice([10.0, 30.0, 60.0])
    return margin_mm if is_room(number) or rng.random() < _KEPT_APART else None


def _without_zones(text: str) -> str:
    before, _, after = text.partition("zones:\n")
    return before + after[after.index("times:") :]


def _kept_apart(file: Path, text: str, margin_mm: float) -> CellBundle:
    file.write_text(f"{text}separation: {{margin: {margin_mm:g}}}\n")
    bundle, problems = check_cell(file)
    assert bundle is not None, problems
    return bundle


def _least_m(paths: Sequence[_Path]) -> float:
    """The least distance of two robots if each could be anywhere on its path, 0.2 s from place to place [m]."""
    return min(
        _apart_m(one, one.points[::5], other, other.points[::5], one.moves[:, None] & other.moves)
        for one, other in itertools.combinations(paths, 2)
    )


def _rests_apart_m(paths: Sequence[_Path]) -> float:
    """The least distance of a robot before or after its program from another one on its way, of links that move [m].

    A robot that rests in the way of another one lets that one never come to its end.
    """
    return min(
        _apart_m(one, one.points[[0, -1]], other, other.points, one.moves[:, None] | other.moves)
        for one, other in itertools.permutations(paths, 2)
    )


def _apart_m(one: _Path, at: np.ndarray, other: _Path, its: np.ndarray, count: np.ndarray) -> float:
    """The least distance of two robots, each wherever it may be, of the pairs of links that `count` `(c, c)` [m]."""
    each = (capsule_distance(points[:, None], one.radii[:, None], its[:, None], other.radii) for points in at)
    return min(float(away[..., count].min()) for away in each)
