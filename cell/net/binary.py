"""Byte layout of the messages that are mostly numbers: the two streams of axis samples, and presences.

Little-endian, no padding. The fourth byte of the magic is the version; another version is another message.

SetpointBlock:

| offset | type | field |
|---|---|---|
| 0 | 4 bytes | magic `ZSB4` |
| 4 | u64 | owner |
| 12 | u64 | sequence |
| 20 | u64 | follows |
| 28 | u64 | first_tick |
| 36 | f64 | dt_s |
| 44 | u32 | nominal |
| 48 | u32 | m, number of samples |
| 52 | u16 | n, number of axes |
| 54 | u16 | length of the robot's name in bytes |
| 56 | u16 | bit 0: with torque, bit 1: a program runs, the others 0 |
| 58 | u16 | k, number of events |
| 60 | u64 | epoch |
| 68 | utf-8 | the robot's name |
| then | k times u64, u64, u16, u8 | events: tick, number, output, value (0 or 1) |
| then | m * n f64 | position, one sample after the other |
| then | m * n f64 | velocity, likewise |
| then | m * n f64 | torque, likewise, if bit 0 says so |

DriveFeedback:

| offset | type | field |
|---|---|---|
| 0 | 4 bytes | magic `ZDF4` |
| 4 | u64 | sequence |
| 12 | u64 | tick |
| 20 | u64 | owner |
| 28 | u64 | block |
| 36 | u64 | refused |
| 44 | u64 | event |
| 52 | u32 | level |
| 56 | u8 | state, a `PlayoutState` |
| 57 | u8 | bit 0 referenced, bit 1 enabled, bit 2 with torque, the others 0 |
| 58 | u16 | n, number of axes |
| 60 | u16 | length of the robot's name in bytes |
| 62 | u16 | length of the gateway's boot in bytes |
| 64 | u32 | outputs, bit i for the i-th of the claim's `outputs` |
| 68 | utf-8 | the robot's name |
| then | utf-8 | the gateway's boot |
| then | n u8 | axes, an `AxisStatus` each |
| then | n f64 | position |
| then | n f64 | velocity |
| then | n f64 | commanded |
| then | n f64 | torque, if bit 2 says so |

Presence:

| offset | type | field |
|---|---|---|
| 0 | 4 bytes | magic `ZPR3` |
| 4 | u32 | length of the head in bytes |
| 8 | u16 | c, number of capsules of the body |
| 10 | u16 | p, number of its poses |
| 12 | u16 | k, number of capsules of a section |
| 14 | u16 | s, number of sections |
| 16 | u16 | t, number of pieces |
| 18 | utf-8 | the head: a JSON object of all that is no array |
| then | s u64 | ids of the sections |
| then | t u32 | their pieces: t is s with a plan, else 0 |
| then | c f32 | radii_m of the body |
| then | p f32 | its growth_m |
| then | p * c * 6 f32 | its poses: ax, ay, az, bx, by, bz of each capsule, one pose after the other |
| then | p * 3 f32 | its TCP: x, y, z, one pose after the other |
| then | s * k f32 | radii of the sections |
| then | s * k * 6 f32 | points of the sections, as the poses |

PlannedWay:

| offset | type | field |
|---|---|---|
| 0 | 4 bytes | magic `ZPW2` |
| 4 | u32 | length of the head in bytes |
| 8 | u16 | k, number of capsules of a piece |
| 10 | u16 | s, number of pieces |
| 12 | utf-8 | the head: a JSON object of all that is no array |
| then | s u64 | ids of the pieces |
| then | s * k f32 | radii of the pieces |
| then | s * k * 6 f32 | points of the pieces: ax, ay, az, bx, by, bz of each capsule, one piece after the other |
"""

import struct

import numpy as np
from numpy.typing import NDArray

from cell.messages import AxisStatus, Body, DriveFeedback, OutputEvent, PlayoutState, SetpointBlock
from cell.messages.presence import MOST_CAPSULES, MOST_POSES
from cell.messages.sections import MOST_SECTIONS, Pieces, Sections, Single, Way
from cell.messages.setpoints import MOST_EVENTS
from cell.net.errors import CodecError

MOST_AXES = 64
MOST_SAMPLES = 10_000
MOST_NUMBERS = 2**18
"""Of all samples of a block: a gateway reads one within its bus cycle. It is 10 s of 8 axes with torque, each ms."""
MOST_COUNT = 2**62
"""Of ticks, sequences and owners: what is computed from them still fits its field."""
LARGEST = 1e12
"""No sample is beyond, so that no square of one overflows."""
FARTHEST_M = 1e6
"""Where a capsule can be, and how large it can be."""
_SETPOINTS = struct.Struct("<4s4QdIIHHHHQ")
_EVENT = struct.Struct("<QQHB")
_FEEDBACK = struct.Struct("<4s6QIBBHHHI")
_SETPOINTS_MAGIC = b"ZSB4"
_FEEDBACK_MAGIC = b"ZDF4"
_BODY = struct.Struct("<4sIHHHHH")
_BODY_MAGIC = b"ZPR3"
_PLANNED = struct.Struct("<4sIHH")
_PLANNED_MAGIC = b"ZPW2"


def encode_setpoints(block: SetpointBlock) -> bytes:
    """The bytes of a block. Raises `CodecError` for arrays of the wrong shape or numbers that do not fit."""
    kind = "SetpointBlock"
    samples = [_floats(kind, "position", block.position), _floats(kind, "velocity", block.velocity)]
    if block.torque is not None:
        samples.append(_floats(kind, "torque", block.torque))
    shapes = [array.shape for array in samples]
    if len(shapes[0]) != 2 or len(set(shapes)) > 1:
        raise CodecError(kind, f"position, velocity and torque {shapes} must all be (m, n)")
    name = block.robot.encode()
    m, n = shapes[0]
    flags = (block.torque is not None) | block.program << 1
    try:
        header = _SETPOINTS.pack(
            _SETPOINTS_MAGIC, block.owner, block.sequence, block.follows, block.first_tick,
            block.dt_s, block.nominal, m, n, len(name), flags, len(block.events), block.epoch,
        )  # fmt: skip
        events = b"".join(_EVENT.pack(each.tick, each.number, each.output, each.value) for each in block.events)
    except struct.error as error:
        raise CodecError(kind, f"header: {error}") from error
    _check_block(m, n, block.nominal, block.dt_s, len(samples), len(block.events))
    return header + name + events + b"".join(array.tobytes() for array in samples)


def decode_setpoints(data: bytes) -> SetpointBlock:
    """The block in `data`. Raises `CodecError`."""
    reader = _Reader("SetpointBlock", data)
    head = reader.header(_SETPOINTS, _SETPOINTS_MAGIC)
    owner, sequence, follows, first_tick, dt_s, nominal, m, n, name_length, flags, event_count, epoch = head
    if flags > 3:
        raise CodecError("SetpointBlock", f"flags {flags:#06x}: only bits 0 and 1 are in use")
    count = 3 if flags & 1 else 2
    # All sizes by the header first: what is refused costs nothing.
    _check_block(m, n, nominal, dt_s, count, event_count)
    _check_counts("SetpointBlock", owner, sequence, follows, first_tick, epoch)
    reader.expect(name_length + event_count * _EVENT.size + 8 * count * m * n)
    robot = reader.text(name_length)
    events = tuple(_event(reader.take(_EVENT.size)) for _ in range(event_count))
    samples = reader.floats(count * m * n).reshape(count, m, n)
    torque = samples[2] if flags & 1 else None
    return SetpointBlock(
        robot, owner, sequence, follows, first_tick, dt_s, nominal, samples[0], samples[1], torque, events,
        bool(flags & 2), epoch,
    )  # fmt: skip


def _event(data: bytes) -> OutputEvent:
    tick, number, output, value = _EVENT.unpack(data)
    _check_counts("SetpointBlock", tick, number)
    if value > 1:
        raise CodecError("SetpointBlock", f"value {value} of an event; an output is 0 or 1")
    return OutputEvent(tick, number, output, bool(value))


def _check_block(m: int, n: int, nominal: int, dt_s: float, arrays: int, events: int) -> None:
    if not (1 <= m <= MOST_SAMPLES and 1 <= n <= MOST_AXES and nominal <= m):
        allowed = f"1 to {MOST_SAMPLES} samples, 1 to {MOST_AXES} axes, nominal <= samples"
        raise CodecError("SetpointBlock", f"{m} samples, {nominal} nominal, {n} axes: allowed are {allowed}")
    if arrays * m * n > MOST_NUMBERS:
        raise CodecError("SetpointBlock", f"{arrays * m * n} numbers, allowed are up to {MOST_NUMBERS}")
    if events > MOST_EVENTS:
        raise CodecError("SetpointBlock", f"{events} events, allowed are up to {MOST_EVENTS}")
    if not 0.0 < dt_s <= 1.0:
        raise CodecError("SetpointBlock", f"dt_s {dt_s}, allowed is above 0 up to 1")


def _check_counts(kind: str, *counts: int) -> None:
    if max(counts) > MOST_COUNT:
        raise CodecError(kind, f"a count of {max(counts)}, allowed is up to 2^62")


def encode_feedback(feedback: DriveFeedback) -> bytes:
    """The bytes of a feedback. Raises `CodecError` for arrays of the wrong shape or numbers that do not fit."""
    kind = "DriveFeedback"
    n = len(feedback.axes)
    arrays = [feedback.position, feedback.velocity, feedback.commanded]
    if feedback.torque is not None:
        arrays.append(feedback.torque)
    if any(array.shape != (n,) for array in arrays):
        raise CodecError(kind, f"arrays {[array.shape for array in arrays]} must all be ({n},), as many as axes")
    # All at once: this is done in every bus cycle.
    samples = np.concatenate(arrays, dtype="<f8")
    if not np.isfinite(samples).all():
        raise CodecError(kind, _not_finite("position, velocity, commanded and torque"))
    robot, boot = feedback.robot.encode(), feedback.boot.encode()
    flags = feedback.referenced | feedback.enabled << 1 | (feedback.torque is not None) << 2
    try:
        header = _FEEDBACK.pack(
            _FEEDBACK_MAGIC, feedback.sequence, feedback.tick, feedback.owner, feedback.block, feedback.refused,
            feedback.event, feedback.level, feedback.state, flags, n, len(robot), len(boot), feedback.outputs,
        )  # fmt: skip
    except struct.error as error:
        raise CodecError(kind, f"header: {error}") from error
    return header + robot + boot + bytes(feedback.axes) + samples.tobytes()


def decode_feedback(data: bytes) -> DriveFeedback:
    """The feedback in `data`. Raises `CodecError`."""
    reader = _Reader("DriveFeedback", data)
    head = reader.header(_FEEDBACK, _FEEDBACK_MAGIC)
    sequence, tick, owner, block, refused, event, level, state, flags, n, robot_length, boot_length, outputs = head
    if flags > 7:
        raise CodecError("DriveFeedback", f"flags {flags:#04x}: only bits 0 to 2 are in use")
    if n > MOST_AXES:
        raise CodecError("DriveFeedback", f"{n} axes, allowed are up to {MOST_AXES}")
    _check_counts("DriveFeedback", sequence, tick, owner, block, refused, event)
    robot, boot = reader.text(robot_length), reader.text(boot_length)
    count = 4 if flags & 4 else 3
    reader.expect(n + 8 * count * n)
    try:
        playout = PlayoutState(state)
        axes = tuple(AxisStatus(value) for value in reader.take(n))
    except ValueError as error:
        raise CodecError("DriveFeedback", str(error)) from error
    samples = [reader.floats(n) for _ in range(count)]
    torque = samples[3] if flags & 4 else None
    return DriveFeedback(
        robot, boot, sequence, tick, owner, block, playout, level, refused, bool(flags & 1), bool(flags & 2),
        samples[0], samples[1], samples[2], axes, torque, outputs, event,
    )  # fmt: skip


def encode_presence(head: bytes, body: Body, way: Way) -> bytes:
    """The bytes of a presence: its head, and the arrays of its body and way. Raises `CodecError` if they do not fit."""
    c, p = len(body.radii_m), len(body.growth_m)
    if body.poses.size != 6 * c * p or len(body.poses) != p or body.tcp_m.shape != (p, 3):
        found = f"radii_m {body.radii_m.shape}, growth_m {body.growth_m.shape}, poses {body.poses.shape}"
        found += f", tcp_m {body.tcp_m.shape}"
        raise CodecError("Presence", f"{found}: allowed are (c,), (p,), (p, c, 2, 3), (p, 3)")
    of_body = _body_values(body.radii_m, body.growth_m, body.poses, body.tcp_m)
    _check_body(of_body, c, p)
    ids, of_way = _section_values("Presence", way.sections)
    k, s, t = way.sections.radii.shape[-1], len(way.sections), len(way.pieces)
    if t not in (0, s):
        raise CodecError("Presence", f"{t} pieces of {s} sections: allowed are none or one of each")
    header = _BODY.pack(_BODY_MAGIC, len(head), c, p, k, s, t)
    pieces = way.pieces.astype("<u4").tobytes()
    return header + head + ids + pieces + of_body.tobytes() + of_way.tobytes()


def decode_presence(data: bytes) -> tuple[bytes, tuple[Single, Single, Single, Single], Sections, Pieces]:
    """The head; radii `(c,)`, growth `(p,)`, poses `(p, c, 2, 3)`, TCP `(p, 3)` of the body; sections and their pieces.

    Raises `CodecError`.
    """
    reader = _Reader("Presence", data)
    length, c, p, k, s, t = reader.header(_BODY, _BODY_MAGIC)
    head = reader.take(length)
    if t not in (0, s):
        raise CodecError("Presence", f"{t} pieces of {s} sections: allowed are none or one of each")
    poses = c + p + 6 * c * p
    count = poses + 3 * p
    reader.expect(8 * s + 4 * (t + count + 7 * s * k))
    ids = reader.ids(s)
    pieces = np.frombuffer(reader.take(4 * t), dtype="<u4").astype(np.uint32)
    body = reader.singles(count)
    _check_body(body, c, p)
    arrays = body[:c], body[c : c + p], body[c + p : poses].reshape(p, c, 2, 3), body[poses:].reshape(p, 3)
    return head, arrays, _sections("Presence", reader, ids, k), pieces


def encode_planned_way(head: bytes, pieces: Sections) -> bytes:
    """The bytes of a planned way: its head, and its arrays. Raises `CodecError` if they do not fit."""
    ids, values = _section_values("PlannedWay", pieces)
    header = _PLANNED.pack(_PLANNED_MAGIC, len(head), pieces.radii.shape[-1], len(pieces))
    return header + head + ids + values.tobytes()


def decode_planned_way(data: bytes) -> tuple[bytes, Sections]:
    """The head and the pieces. Raises `CodecError`."""
    reader = _Reader("PlannedWay", data)
    length, k, s = reader.header(_PLANNED, _PLANNED_MAGIC)
    head = reader.take(length)
    reader.expect(8 * s + 28 * s * k)
    return head, _sections("PlannedWay", reader, reader.ids(s), k)


def _section_values(kind: str, sections: Sections) -> tuple[bytes, Single]:
    s, k = len(sections.ids), sections.radii.shape[-1]
    if sections.radii.shape != (s, k) or sections.points.size != 6 * s * k:
        found = f"{s} ids, radii {sections.radii.shape}, points {sections.points.shape}"
        raise CodecError(kind, f"{found}: allowed are (s,), (s, k), (s, k, 2, 3)")
    values = _body_values(sections.radii.reshape(-1), sections.points)
    _check_sections(kind, values, k, s)
    return sections.ids.astype("<u8").tobytes(), values


def _sections(kind: str, reader: "_Reader", ids: NDArray[np.uint64], k: int) -> Sections:
    s = len(ids)
    values = reader.singles(7 * s * k)
    _check_sections(kind, values, k, s)
    return Sections(ids, values[s * k :].reshape(s, k, 2, 3), values[: s * k].reshape(s, k))


def _body_values(*arrays: Single) -> Single:
    return np.concatenate([each.reshape(-1) for each in arrays], dtype="<f4")


def _check_body(values: Single, c: int, p: int) -> None:
    """Of the arrays one after the other."""
    if not (c <= MOST_CAPSULES and p <= MOST_POSES and (c > 0 or p == 0)):
        allowed = f"up to {MOST_CAPSULES} capsules and {MOST_POSES} poses, and at least one capsule in a pose"
        raise CodecError("Presence", f"{p} poses of {c} capsules: allowed are {allowed}")
    _check_lengths("Presence", values, c + p)


def _check_sections(kind: str, values: Single, k: int, s: int) -> None:
    if not (k <= MOST_CAPSULES and s <= MOST_SECTIONS and (k > 0 or s == 0)):
        allowed = f"up to {MOST_CAPSULES} capsules and {MOST_SECTIONS} sections, and at least one capsule in a section"
        raise CodecError(kind, f"{s} sections of {k} capsules: allowed are {allowed}")
    _check_lengths(kind, values, s * k)


def _check_lengths(kind: str, values: Single, lengths: int) -> None:
    """The first `lengths` values are radii and growths."""
    if not (np.abs(values) <= FARTHEST_M).all():
        raise CodecError(kind, f"a length or coordinate that is NaN, infinite or beyond {FARTHEST_M:g} m")
    if (values[:lengths] < 0.0).any():
        raise CodecError(kind, "a radius or growth below zero")


def _floats(kind: str, name: str, values: NDArray[np.float64]) -> NDArray[np.float64]:
    array = np.ascontiguousarray(values, dtype="<f8")
    if not np.isfinite(array).all():
        raise CodecError(kind, _not_finite(name))
    return array


def _not_finite(name: str) -> str:
    return f"{name} holds NaN or infinity; only finite numbers travel"


class _Reader:
    """Takes a message apart from front to back and never beyond its end."""

    def __init__(self, kind: str, data: bytes) -> None:
        self._kind = kind
        self._data = data
        self._at = 0

    def header(self, layout: struct.Struct, magic: bytes) -> tuple[int, ...]:
        found, *fields = layout.unpack(self.take(layout.size))
        if found != magic:
            raise CodecError(self._kind, f"magic {found!r}, expected {magic!r}")
        return tuple(fields)

    def take(self, count: int) -> bytes:
        part = self._data[self._at : self._at + count]
        if len(part) != count:
            raise CodecError(self._kind, f"{len(self._data)} bytes end {count - len(part)} bytes early")
        self._at += count
        return part

    def expect(self, count: int) -> None:
        if len(self._data) - self._at != count:
            raise CodecError(self._kind, f"{len(self._data)} bytes, the header asks for {self._at + count}")

    def text(self, count: int) -> str:
        try:
            return self.take(count).decode()
        except UnicodeDecodeError as error:
            raise CodecError(self._kind, f"name is not UTF-8: {error}") from error

    def ids(self, count: int) -> NDArray[np.uint64]:
        return np.frombuffer(self.take(8 * count), dtype="<u8").astype(np.uint64)

    def singles(self, count: int) -> Single:
        return np.frombuffer(self.take(4 * count), dtype="<f4").astype(np.float32)

    def floats(self, count: int) -> NDArray[np.float64]:
        array = np.frombuffer(self.take(8 * count), dtype="<f8").astype(np.float64)
        if not (np.abs(array) <= LARGEST).all():
            raise CodecError(self._kind, f"holds NaN, infinity or a number beyond {LARGEST:g}; those do not travel")
        return array
