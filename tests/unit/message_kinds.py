"""Any message of a kind: every value that its schema allows, the edges of its ranges first of all."""

import dataclasses
import math
from enum import Enum
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import numpy as np
from annotated_types import Ge, Gt, Le
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cell.geometry import MEASURED
from cell.messages import (
    AxisStatus,
    Body,
    Confinement,
    DriveFeedback,
    FramePose,
    OutputEvent,
    Place,
    PlaceFrame,
    PlannedWay,
    PlayoutState,
    Sections,
    SetpointBlock,
    SetZone,
    Way,
    ZoneGeometry,
)
from cell.messages.sections import Stay
from cell.messages.zone import Edge
from cell.net.binary import FARTHEST_M, LARGEST, MOST_COUNT

SAMPLES = st.floats(-LARGEST, LARGEST)
NAMES = st.text(st.characters(codec="utf-8"), max_size=12)
COUNTS = st.integers(0, MOST_COUNT)
PLAIN: dict[object, st.SearchStrategy[Any]] = {
    float: st.floats(allow_nan=False, allow_infinity=False),
    int: st.integers(-(2**63), 2**63 - 1),
    str: NAMES,
    bool: st.booleans(),
    type(None): st.none(),
}


def of(kind: Any) -> st.SearchStrategy[Any]:
    """Any value of a message's field type."""
    if kind in PLAIN:
        return PLAIN[kind]
    if kind is Body:
        return bodies()
    if kind is Way:
        return ways()
    if kind is Sections:
        return sections()
    if kind in (Confinement, FramePose, Place, PlaceFrame, ZoneGeometry):
        return oriented(kind)
    if kind is PlannedWay:
        return planned_ways()
    if kind is SetZone:
        return zone_changes()
    if dataclasses.is_dataclass(kind):
        return st.builds(kind, **fields(kind))
    if isinstance(kind, type) and issubclass(kind, Enum):
        return st.sampled_from(kind)
    parts = get_args(kind)
    if get_origin(kind) is Annotated:
        return _within(parts[0], parts[1:])
    if get_origin(kind) is dict:
        return st.dictionaries(of(parts[0]), of(parts[1]), max_size=3)
    if get_origin(kind) is tuple and parts[-1] is Ellipsis:
        return st.lists(of(parts[0]), max_size=3).map(tuple)
    if get_origin(kind) is tuple:
        return st.tuples(*map(of, parts))
    return st.one_of(*map(of, parts))


def fields(kind: Any) -> dict[str, st.SearchStrategy[Any]]:
    """Any value of each field of a message class."""
    hints = get_type_hints(kind, include_extras=True)
    return {field.name: of(hints[field.name]) for field in dataclasses.fields(kind)}


def _within(kind: Any, limits: tuple[object, ...]) -> st.SearchStrategy[Any]:
    if kind not in (int, float):
        return of(kind)
    low: Any = next((limit.ge for limit in limits if isinstance(limit, Ge)), None)
    above: Any = next((limit.gt for limit in limits if isinstance(limit, Gt)), None)
    high: Any = next((limit.le for limit in limits if isinstance(limit, Le)), None)
    if kind is int:
        return st.integers(low, high) | st.sampled_from([low, high])
    values = st.floats(above if low is None else low, high, exclude_min=low is None)
    return values if low is None else values | st.sampled_from([low, high])


@st.composite
def bodies(draw: st.DrawFn) -> Body:
    hints = get_type_hints(Body, include_extras=True)
    plain = {name: of(hints[name]) for name in ("base", "reach_m")}
    n, c = draw(st.integers(0, 3)), draw(st.integers(1, 3))
    lengths, coordinates = st.floats(0.0, FARTHEST_M, width=32), st.floats(-FARTHEST_M, FARTHEST_M, width=32)
    radii, growth = (draw(arrays(np.float32, count, elements=lengths)) for count in (c, n))
    poses = draw(arrays(np.float32, (n, c, 2, 3), elements=coordinates))
    tcp = draw(arrays(np.float32, (n, 3), elements=coordinates))
    return Body(n > 0 and draw(st.booleans()), draw(plain["base"]), draw(plain["reach_m"]), radii, poses, growth, tcp)


@st.composite
def sections(draw: st.DrawFn) -> Sections:
    n, c = draw(st.integers(0, 3)), draw(st.integers(1, 3))
    lengths, coordinates = st.floats(0.0, FARTHEST_M, width=32), st.floats(-FARTHEST_M, FARTHEST_M, width=32)
    ids = draw(arrays(np.uint64, n, elements=st.integers(0, 2**64 - 1)))
    points = draw(arrays(np.float32, (n, c, 2, 3), elements=coordinates))
    return Sections(ids, points, draw(arrays(np.float32, (n, c), elements=lengths)))


@st.composite
def ways(draw: st.DrawFn) -> Way:
    some = draw(sections())
    owned = draw(st.integers(0, len(some)))
    links, fixed = (st.lists(each, max_size=3).map(tuple) for each in (NAMES, COUNTS))
    plan = draw(st.sampled_from([0, 1, MOST_COUNT]))
    pieces = draw(arrays(np.uint32, len(some) if plan else 0, elements=st.integers(0, 2**32 - 1)))
    return Way(some, draw(st.integers(0, owned)), owned, draw(links), draw(fixed), plan, pieces)


@st.composite
def planned_ways(draw: st.DrawFn) -> PlannedWay:
    """A planned way with stays in pieces that it has."""
    values = {name: draw(strategy) for name, strategy in fields(PlannedWay).items() if name != "stays"}
    count = len(values["pieces"])
    spans = draw(st.lists(st.tuples(NAMES, st.integers(0, count - 1), st.integers(0, count - 1)))) if count else []
    return PlannedWay(stays=tuple(Stay(zone, *sorted(span)) for zone, *span in spans), **values)


@st.composite
def oriented(draw: st.DrawFn, kind: Any) -> Any:
    """A message with an orientation, which has length 1, and the lengths of its shape."""
    values = {name: draw(strategy) for name, strategy in fields(kind).items() if name != "quaternion_xyzw"}
    if kind is ZoneGeometry:
        values["shape"] = shape = draw(st.sampled_from(list(MEASURED)))
        values["size_m"] = tuple(draw(of(Edge)) for _ in MEASURED[shape].lengths)
    raw = draw(st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).filter(lambda q: math.hypot(*q) > 1e-3))
    return kind(quaternion_xyzw=tuple(part / math.hypot(*raw) for part in raw), **values)


@st.composite
def zone_changes(draw: st.DrawFn) -> SetZone:
    """An order with a shape that is one, or without."""
    values = {name: draw(strategy) for name, strategy in fields(SetZone).items()}
    values["shape"] = shape = draw(st.none() | st.sampled_from(list(MEASURED)))
    values["size_m"] = () if shape is None else tuple(draw(of(Edge)) for _ in MEASURED[shape].lengths)
    values["place"] = draw(of(Place))
    return SetZone(**values)


@st.composite
def blocks(draw: st.DrawFn) -> SetpointBlock:
    shape = draw(st.tuples(st.integers(1, 5), st.integers(1, 4)))
    samples = arrays(np.float64, shape, elements=SAMPLES)
    numbers = [draw(COUNTS) for _ in range(4)]
    dt_s, nominal = draw(st.floats(1e-6, 1.0)), draw(st.integers(0, shape[0]))
    torque = draw(st.none() | samples)
    events = draw(
        st.lists(st.builds(OutputEvent, COUNTS, COUNTS, st.integers(0, 2**16 - 1), st.booleans()), max_size=3)
    )
    last = torque, tuple(events), draw(st.booleans())
    return SetpointBlock(draw(NAMES), *numbers, dt_s, nominal, draw(samples), draw(samples), *last)


@st.composite
def feedbacks(draw: st.DrawFn) -> DriveFeedback:
    axes = draw(st.lists(st.sampled_from(AxisStatus), max_size=5).map(tuple))
    values = arrays(np.float64, len(axes), elements=SAMPLES)
    numbers = [draw(COUNTS) for _ in range(4)]
    level, flags = draw(st.integers(0, 2**32 - 1)), draw(st.tuples(st.booleans(), st.booleans()))
    state, refused = draw(st.sampled_from(PlayoutState)), draw(COUNTS)
    positions = [draw(values) for _ in range(3)]
    last = draw(st.none() | values), draw(st.integers(0, 2**32 - 1)), draw(COUNTS)
    return DriveFeedback(draw(NAMES), draw(NAMES), *numbers, state, level, refused, *flags, *positions, axes, *last)


def messages(kind: type) -> st.SearchStrategy[Any]:
    special = {SetpointBlock: blocks(), DriveFeedback: feedbacks()}
    return special[kind] if kind in special else of(kind)


def same(a: Any, b: Any) -> bool:
    """Equality of messages that looks into arrays."""
    if isinstance(a, np.ndarray):
        return np.array_equal(a, b)
    if not dataclasses.is_dataclass(a) or isinstance(a, type):
        return bool(a == b)
    return type(a) is type(b) and all(
        same(getattr(a, each.name), getattr(b, each.name)) for each in dataclasses.fields(a)
    )
