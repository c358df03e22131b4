"""No message that fits the published schemas, from anybody, ends a process: not the manager, no agent, no gateway.

Each core gets what the codec lets through, one message after another, and must step on. What a core sends must be
fit to travel too: a message that cannot be encoded ends the process that sends it.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from cell.config.settings import CorrectionSettings, SensorFrame
from cell.core import Arrived, Effect, Publish, Request
from cell.manager.presences import MOST_STRANGERS
from cell.messages import (
    COMMANDS,
    STATES,
    AxisStatus,
    DriveFeedback,
    Enable,
    Heard,
    ManagerState,
    Mode,
    OutputEvent,
    PlayoutState,
    Run,
    SetpointBlock,
)
from cell.net.binary import encode_planned_way, encode_presence
from cell.net.codec import decode, decode_call, encode, message_schemas
from cell.net.errors import CodecError
from tests.unit.across.travelling import fit_to_travel
from tests.unit.agent_world import AgentWorld
from tests.unit.gateway_world import World as GatewayWorld
from tests.unit.manager_world import INSIDE, Robot
from tests.unit.manager_world import World as ManagerWorld
from tests.unit.message_kinds import blocks, bodies, feedbacks, messages, sections, ways

KNOWN = (
    "left", "right", "middle", "handover", "seam", "b1", "m1", "m", "boot", "g1", "gateway", "a1", "digest", "d", "J1",
    "J2", "X", "line", "left_bus", "stranger",
)  # fmt: skip
"""Names that mean something in one of the worlds."""
SCHEMAS = message_schemas()
KINDS = {kind.__name__: kind for kind in STATES}
PROGRAM = "MJ J1=10 J2=-10 J3=30 J4=0 J5=60 J6=0\nTRACK seam\nML Y=280 F=60\nTRACK OFF\nMJ J2=50 J3=-25\nEND"
SEAM = CorrectionSettings("seam", SensorFrame.BASE, None, 0.05, 0.0, 0.05, 0.2, 0.2, 2.0)


def fits(schema: dict[str, Any], defs: dict[str, Any]) -> st.SearchStrategy[Any]:
    """Any JSON value of a schema; known names and the edges of ranges come often."""
    if "$ref" in schema:
        return fits(defs[schema["$ref"].rpartition("/")[2]], defs)
    if "anyOf" in schema:
        return st.one_of([fits(each, defs) for each in schema["anyOf"]])
    if "enum" in schema:
        return st.sampled_from(schema["enum"])
    match schema["type"]:
        case "object" if "properties" in schema:
            required = schema.get("required", [])
            parts = {name: fits(each, defs) for name, each in schema["properties"].items()}
            optional = {name: part for name, part in parts.items() if name not in required}
            return st.fixed_dictionaries({name: parts[name] for name in required}, optional=optional)
        case "object" if schema.get("additionalProperties"):
            return st.dictionaries(st.sampled_from(KNOWN), fits(schema["additionalProperties"], defs), max_size=3)
        case "object":
            return st.just({})
        case "array" if "prefixItems" in schema:
            return st.tuples(*(fits(each, defs) for each in schema["prefixItems"])).map(list)
        case "array":
            return st.lists(fits(schema["items"], defs), max_size=3)
        case "string":
            return st.sampled_from(KNOWN) | st.text(max_size=8)
        case "integer":
            low, high = schema.get("minimum", -(2**80)), schema.get("maximum", 2**80)
            return st.integers(max(low, -3), min(high, 20)) | st.sampled_from([low, high])
        case "number":
            above = schema.get("exclusiveMinimum")
            low, high = schema.get("minimum", above if above is not None else -1e308), schema.get("maximum", 1e308)
            edges = [each for each in (low, high, 0.0, 1.0) if low <= each <= high and each != above]
            return st.floats(max(low, -2.0), min(high, 2.0), exclude_min=above is not None) | st.sampled_from(edges)
        case "boolean":
            return st.booleans()
        case "null":
            return st.none()
        case other:
            raise NotImplementedError(other)


def json_of(name: str) -> st.SearchStrategy[bytes]:
    schema = SCHEMAS[name]
    return fits(schema, schema.get("$defs", {})).map(lambda value: json.dumps(value).encode())


@st.composite
def streams(draw: st.DrawFn, kind: type) -> bytes:
    """A block or a feedback of somebody who looks like the owner, of the gateway, or of nobody."""
    some: Any = draw(blocks() if kind is SetpointBlock else feedbacks().filter(lambda each: len(each.axes) > 0))
    tick, n = draw(st.sampled_from([0, 1, 5, 700, 2**62]) | st.integers(0, 3000)), draw(st.sampled_from([1, 2, 6]))
    changes: dict[str, Any] = {"robot": "left", "owner": draw(st.sampled_from([0, 7, 100, 101]))}
    changes["sequence"] = draw(st.integers(0, 5000) | st.just(2**62))
    names = ("position", "velocity", "torque", "commanded")
    shape = (len(some.position), n) if kind is SetpointBlock else (n,)
    arrays = {name: getattr(some, name) for name in names if getattr(some, name, None) is not None}
    changes |= {name: np.resize(array, shape) for name, array in arrays.items()}
    if kind is SetpointBlock:
        events = tuple(OutputEvent(tick + i, i + 1, i, True) for i in range(draw(st.integers(0, 2))))
        changes |= {"first_tick": tick, "dt_s": 0.004, "events": events}
    else:
        changes |= {"tick": tick, "boot": draw(st.sampled_from(KNOWN)), "axes": (some.axes * n)[:n]}
    return encode(replace(some, **changes))


def state_bytes(name: str) -> st.SearchStrategy[tuple[str, bytes]]:
    if name == "Presence":
        data = st.builds(encode_presence, json_of(name), bodies(), ways()) | messages(KINDS[name]).map(encode)
    elif name == "PlannedWay":
        data = st.builds(encode_planned_way, json_of(name), sections()) | messages(KINDS[name]).map(encode)
    elif name in SCHEMAS:
        data = json_of(name) | messages(KINDS[name]).map(encode)
    else:
        data = streams(KINDS[name]) | messages(KINDS[name]).map(encode) | st.binary(max_size=200)
    return data.map(lambda each: (name, each))


def call_bytes(role: str) -> st.SearchStrategy[tuple[str, bytes]]:
    names = [f"{role}/{verb}" for verb in sorted(COMMANDS[role])]
    return st.sampled_from(names).flatmap(lambda name: json_of(name).map(lambda data: (name, data)))


Said = tuple[tuple[str, bytes], bool]


def said(role: str) -> st.SearchStrategy[list[Said]]:
    """What anybody may say to a process: state messages and calls, with a fresh echo or what they have themselves."""
    kinds = st.sampled_from(sorted(KINDS)).flatmap(state_bytes)
    return st.lists(st.tuples(kinds | call_bytes(role), st.booleans()), min_size=1, max_size=8)


def read(name: str, data: bytes, fresh: Heard | None, count: int) -> object | None:
    """The message as a shell hands it to its core; None when the codec refuses it."""
    try:
        if "/" in name:
            call = decode_call(*name.split("/"), data)
            return Request(f"any{count}", replace(call, heard=fresh) if fresh is not None else call)
        message: Any = decode(KINDS[name], data)
    except CodecError:
        return None
    return replace(message, heard=fresh) if fresh is not None and name in ("Presence", "JogHeld") else message


class AnyAgent(AgentWorld):
    """Whatever the agent makes of what it hears, its gateway is here only to answer."""

    def _perform(self, effect: Effect) -> None:
        fit_to_travel(effect)
        if not isinstance(effect, Publish) or not isinstance(effect.message, SetpointBlock):
            super()._perform(effect)


class AnyManager(ManagerWorld):
    def _perform(self, effect: Effect) -> None:
        fit_to_travel(effect)
        super()._perform(effect)


@dataclass
class Process:
    """A core in its world, and how to talk to it."""

    hear: Callable[[Any], None]
    newest: Callable[[], Any]
    """Its newest state."""
    step: Callable[[], object]

    def survives(self, things: list[Said]) -> None:
        for count, ((name, data), young) in enumerate(things):
            fresh = Heard(self.newest().boot, self.newest().sequence) if young else None
            message = read(name, data, fresh, count)
            if message is not None:
                self.hear(message)
                self.step()
        self.step()


SEARCH = (Phase.explicit, Phase.reuse, Phase.generate)
"""A world is too slow for a shrinker."""
QUICK = settings(deadline=None, max_examples=9, suppress_health_check=list(HealthCheck), phases=SEARCH)


@QUICK
@given(said("manager"))
def test_any_messages_leave_the_manager_alive(things: list[Said]) -> None:
    world = AnyManager()
    world.left.wants = True
    world.run()
    manager = world.manager
    Process(lambda m: manager.receive(m, world.now), lambda: world.states[-1], lambda: world.run(0.03)).survives(things)


@QUICK
@given(said("robot"), st.booleans())
def test_any_messages_leave_an_agent_alive(things: list[Said], running: bool) -> None:
    world = AnyAgent(PROGRAM, corrections={"seam": SEAM})
    world.grant()
    world.run(0.1)
    world.call(Enable())
    world.run(0.1)
    if running:
        world.call(Run())
        world.run(0.2)

    def hear(message: object) -> None:
        world.agent.receive(message if isinstance(message, Request) else Arrived(message, world.now), world.now)

    Process(hear, lambda: world.state, lambda: world.run(0.06)).survives(things)


@QUICK
@given(said("gateway"), st.booleans())
def test_any_messages_leave_a_gateway_alive(things: list[Said], enabled: bool) -> None:
    world = GatewayWorld()
    if enabled:
        world.enabled()
    world.ready()

    def hear(message: object) -> None:
        world.core.receive(Arrived(message, world.now) if isinstance(message, ManagerState) else message, world.now)

    Process(hear, lambda: world.state, lambda: world.run(0.03)).survives(things)


def test_robots_that_the_cell_does_not_have_take_no_memory_without_bound() -> None:
    world = ManagerWorld()
    world.run()
    for number in range(500):
        world.manager.receive(Robot(f"stranger{number}").presence(), world.now)
    world.run()
    assert len(world.states[-1].heard) == len(world.cell.robots) + MOST_STRANGERS


def test_more_living_strangers_than_can_be_followed_are_told() -> None:
    world = ManagerWorld()
    world.robots |= {name: Robot(name) for name in (f"stranger{number}" for number in range(MOST_STRANGERS + 2))}
    world.run(0.2)
    assert len(world.states[-1].heard) == len(world.cell.robots) + MOST_STRANGERS
    assert [event.code for event in world.events].count("too_many_robots") == 1


def test_a_robot_that_the_cell_does_not_have_is_seen_once_others_that_are_nowhere_fell_silent() -> None:
    world = ManagerWorld()
    world.run()
    for number in range(MOST_STRANGERS):
        world.manager.receive(Robot(f"stranger{number}").presence(), world.now)
    world.run(1.0)
    intruder = Robot("intruder", x=INSIDE, moving=True)
    for _ in range(3):
        intruder.listen(world.states[-1])
        world.manager.receive(intruder.presence(), world.now)
        world.run(0.05)
    assert "zone_breach" in [event.code for event in world.events]


def test_feedback_of_a_machine_with_other_axes_moves_and_ends_nothing() -> None:
    world = AnyAgent(PROGRAM)
    world.run(0.1)
    world.call(Enable())
    world.run(0.1)
    foreign = DriveFeedback(
        "left", "gateway", 2**40, world.tick, 7, 0, PlayoutState.PLAYING, 0, 0, True, True, np.zeros(2), np.zeros(2),
        np.zeros(2), (AxisStatus.OPERATION_ENABLED,) * 2,
    )  # fmt: skip
    world.agent.receive(Arrived(foreign, world.now), world.now)
    world.run(0.1)
    assert world.state.mode is Mode.READY
