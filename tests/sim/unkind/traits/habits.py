"""What several traits are made of: other objects, other frames."""

from collections.abc import Callable
from dataclasses import replace

from drive_gateway.canopen.cob_id import SDO_FROM_NODE, function_code
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.sim.nodes.node import SimulatedNode
from drive_gateway.sim.services.abort import Abort, AccessRefused
from drive_gateway.sim.services.dictionary import Entry, key_of


def constant(node: SimulatedNode, index: int, sub: int, value: int, relative: bool = False) -> None:
    """An object that can only be read; `relative`: the Node-ID is added to its value."""
    entry = node.objects.entry(key_of(index, sub))
    node.objects.declare(replace(entry, writable=False, default=value, relative=relative))


def number(index: int, sub: int, code: str, value: int, name: str = "") -> Entry:
    """An object of a number that can be read and written."""
    highest = {"B": 0xFF, "H": 0xFFFF, "I": 0xFFFFFFFF}[code]
    return Entry(key_of(index, sub), name, code, True, True, False, 0, highest, value, False, b"")


def refuses(node: SimulatedNode, index: int, sub: int, code: Abort, wrong: Callable[[int], bool]) -> None:
    """A write of a `wrong` value is refused by `code`."""

    def guard(value: int) -> None:
        if wrong(value):
            raise AccessRefused(code)

    node.objects.guard(key_of(index, sub), guard)


def sends(node: SimulatedNode, changed: Callable[[list[CanFrame], float], list[CanFrame]]) -> None:
    """Let `changed` have all frames that the node is about to send; it is called often, without frames, too."""
    received, timed = node.receive, node.timers

    def receive(frame: CanFrame, now: float) -> list[CanFrame]:
        return changed(received(frame, now), node.now)

    def timers() -> list[CanFrame]:
        return changed(timed(), node.now)

    node.receive, node.timers = receive, timers  # type: ignore[method-assign]


def answers_late(node: SimulatedNode, late_s: float) -> None:
    """Every SDO answer comes so much later."""
    waiting: list[tuple[float, CanFrame]] = []

    def late(frames: list[CanFrame], now: float) -> list[CanFrame]:
        for frame in frames:
            waiting.append((now + (late_s if function_code(frame.id) == SDO_FROM_NODE else 0.0), frame))
        due = [frame for at, frame in waiting if at <= now]
        waiting[:] = [(at, frame) for at, frame in waiting if at > now]
        return due

    sends(node, late)
