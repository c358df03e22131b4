"""What must hold within a cell file beyond its schema."""

from collections.abc import Iterator

from cell.config.cell_file import CellFile
from cell.config.document import Document
from cell.config.fields import host_and_port
from cell.config.frame_entry import frame_problems, unknown_frame
from cell.config.problem import KeyPath, Problem
from cell.geometry import NoFrame

BLOCK_PERIOD_S = 0.02
"""An agent sends a set-point block, and its state, this often (architecture, sections 4 and 5.1)."""
MANAGER_PERIOD_S = 0.05
"""The slowest of the two streams that permit motion."""
SHORTEST_NOMINAL_S = 0.1
"""Several blocks may be lost before a robot slows (architecture, section 5.1)."""
PERIODS_PER_DEADLINE = 3
"""A deadline lets at least two messages in a row be lost."""


def check_cell_file(document: Document, cell: CellFile) -> list[Problem]:
    """All contradictions inside the cell file."""
    return [
        *_endpoints(document, cell),
        *_names(document, cell),
        *_frames(document, cell),
        *_corrections(document, cell),
        *_zones(document, cell),
        *_things(document, cell),
        *_spaces(document, cell),
        *_separation(document, cell),
        *_times(document, cell),
    ]


def _endpoints(document: Document, cell: CellFile) -> Iterator[Problem]:
    seen: dict[tuple[str, int], str] = {}
    places: list[tuple[str, str, KeyPath]] = [("the manager", cell.manager.endpoint, ("manager", "endpoint"))]
    for name, entry in cell.gateways.items():
        places.append((f"gateway {name}", entry.endpoint, ("gateways", name, "endpoint")))
    for who, endpoint, path in places:
        other = seen.setdefault(host_and_port(endpoint), who)
        if other != who:
            yield document.problem(path, f"{endpoint!r}, where {other} listens too", "an endpoint of its own")


def _names(document: Document, cell: CellFile) -> Iterator[Problem]:
    gateways, robots = document.keys(("gateways",)), document.keys(("robots",))
    for key, names in (("robots", robots), ("gateways", gateways)):
        if not names:
            yield document.problem((key,), "an empty mapping", "one or more")
    for name, robot in cell.robots.items():
        if robot.gateway not in gateways:
            allowed = f"one of {', '.join(gateways)}"
            yield document.problem(("robots", name, "gateway"), f"unknown gateway {robot.gateway!r}", allowed)
    for variable, owner in cell.variables.items():
        if owner not in robots:
            yield document.problem(("variables", variable), f"unknown robot {owner!r}", f"one of {', '.join(robots)}")
    for meeting, members in cell.meetings.items():
        for index, name in enumerate(members):
            path: KeyPath = ("meetings", meeting, index)
            if name not in robots:
                yield document.problem(path, f"unknown robot {name!r}", f"one of {', '.join(robots)}")
            elif name in members[:index]:
                yield document.problem(path, f"{name!r} a second time", "each robot once")


def _frames(document: Document, cell: CellFile) -> Iterator[Problem]:
    yield from frame_problems(document, cell.frames)
    for key in ("robots", "conveyors", "zones", "things"):
        for name, entry in getattr(cell, key).items():
            yield from unknown_frame(document, (key, name, "frame"), entry.frame)
    for robot, said in cell.robots.items():
        for name, space in said.spaces.items():
            yield from unknown_frame(document, ("robots", robot, "spaces", name, "frame"), space.frame)


def _corrections(document: Document, cell: CellFile) -> Iterator[Problem]:
    belts = document.keys(("conveyors",))
    for belt, conveyor in cell.conveyors.items():
        where: KeyPath = ("conveyors", belt)
        if conveyor.counts_per_metre == 0.0:
            yield document.problem((*where, "counts_per_metre"), "0", "any number but 0")
        if (conveyor.pose is None) is (conveyor.points is None):
            found = "neither pose nor points" if conveyor.pose is None else "pose and points"
            yield document.problem(where, found, "exactly one of them")
            continue
        try:
            conveyor.measured()
        except NoFrame as error:
            yield document.problem((*where, "points"), error.defect, "three points apart from each other")
    for robot, entry in cell.robots.items():
        for name, correction in entry.corrections.items():
            path: KeyPath = ("robots", robot, "corrections", name)
            if name == "off":
                yield document.problem(path, "the name 'off'", "another name: TRACK OFF ends all", at_key=True)
            if (correction.sensor is None) is (correction.conveyor is None):
                found = "neither sensor nor conveyor" if correction.sensor is None else "sensor and conveyor"
                yield document.problem(path, found, "exactly one of them")
            if correction.conveyor is not None and correction.conveyor not in belts:
                allowed = f"one of {', '.join(belts)}" if belts else "a conveyor of this file; there is none"
                yield document.problem((*path, "conveyor"), f"unknown conveyor {correction.conveyor!r}", allowed)
            if correction.conveyor is not None and correction.largest_turn is not None:
                yield document.problem((*path, "largest_turn"), "a turn", "no largest_turn: belts do not turn")


def _things(document: Document, cell: CellFile) -> Iterator[Problem]:
    robots = document.keys(("robots",))
    for name, thing in cell.things.items():
        yield from thing.problems(document, ("things", name), robots)


def _zones(document: Document, cell: CellFile) -> Iterator[Problem]:
    robots = document.keys(("robots",))
    for name, zone in cell.zones.items():
        yield from zone.problems(document, ("zones", name), robots)


def _spaces(document: Document, cell: CellFile) -> Iterator[Problem]:
    for robot, entry in cell.robots.items():
        for name, space in entry.spaces.items():
            yield from space.problems(document, ("robots", robot, "spaces", name))
        for joint, (low, high) in entry.joints.items():
            if not low < high:
                yield document.problem(
                    ("robots", robot, "joints", joint), f"[{low:g}, {high:g}]", "the lower end first"
                )


def _times(document: Document, cell: CellFile) -> Iterator[Problem]:
    times = cell.times
    shortest_fresh = PERIODS_PER_DEADLINE * MANAGER_PERIOD_S
    shortest_command = PERIODS_PER_DEADLINE * BLOCK_PERIOD_S
    rules = (
        (
            "nominal_s",
            times.nominal_s >= SHORTEST_NOMINAL_S,
            f"{SHORTEST_NOMINAL_S:g} or more, so that blocks may be lost",
        ),
        (
            "lead_s",
            times.lead_s + BLOCK_PERIOD_S < times.nominal_s,
            f"less than {times.nominal_s - BLOCK_PERIOD_S:g} (nominal_s {times.nominal_s:g} less one block period of "
            f"{BLOCK_PERIOD_S:g}), so that a block joins before its predecessor brakes",
        ),
        (
            "fresh_s",
            times.fresh_s >= shortest_fresh,
            f"{shortest_fresh:g} or more, {PERIODS_PER_DEADLINE} periods of the manager's state",
        ),
        (
            "command_s",
            times.command_s >= shortest_command,
            f"{shortest_command:g} or more, {PERIODS_PER_DEADLINE} periods of a robot's state",
        ),
        (
            "feedback_lost_s",
            times.feedback_lost_s > times.lead_s,
            f"more than lead_s, {times.lead_s:g}",
        ),
        (
            "owner_silent_s",
            times.owner_silent_s > times.nominal_s,
            f"more than nominal_s, {times.nominal_s:g}, so that lost blocks do not end a claim",
        ),
    )
    for name, holds, allowed in rules:
        if not holds:
            yield document.problem(("times", name), f"{getattr(times, name):g}", allowed)


def _separation(document: Document, cell: CellFile) -> Iterator[Problem]:
    robots, seen = document.keys(("robots",)), set[frozenset[str]]()
    for index, pair in enumerate(() if cell.separation is None else cell.separation.pairs):
        path: KeyPath = ("separation", "pairs", index, "robots")
        if unknown := [name for name in pair.robots if name not in robots]:
            yield document.problem(path, f"unknown robot {unknown[0]!r}", f"two of {', '.join(robots)}")
        elif pair.robots[0] == pair.robots[1]:
            yield document.problem(path, f"{pair.robots[0]} twice", "two different robots")
        elif frozenset(pair.robots) in seen:
            yield document.problem(path, f"{' and '.join(pair.robots)} a second time", "each pair once")
        seen.add(frozenset(pair.robots))
