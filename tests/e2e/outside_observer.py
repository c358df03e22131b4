"""A judge of a running cell that knows the documents and shares no code with the product.

It decodes the bytes of docs/messages.md itself, has its own forward kinematics of the six-axis arm (docs/robots.md) and
its own test of capsules against boxes, and looks at the gateways directly, whatever becomes of the manager.
"""

import json
import struct
import threading
import time
from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import zenoh
from numpy.typing import NDArray
from ruamel.yaml import YAML

Floats = NDArray[np.float64]

_TOGETHER_S = 0.03
"""Two bodies may seem to be in a zone together for as long as the newest words of two gateways differ in age."""
_DEEP_M = 1e-3
_LIMITS = 1.02
_STANDS_AFTER_S = 4.0
"""A robot that says `fault` or `estop` for so long stands."""
_STANDS_RAD = 0.02
_FEEDBACK = struct.Struct("<4s6QIBBHHHI")
_ENABLED = 2


@dataclass
class Arm:
    """One six-axis arm as its files describe it."""

    base_m: Floats
    turned_rad: float
    lengths_m: Mapping[str, float]
    capsules: list[tuple[int, Floats, Floats, float]]
    velocity: Floats
    acceleration: Floats
    jerk: Floats

    @classmethod
    def read(cls, cell: dict[str, Any], robot: str, folder: Path) -> Self:
        """From the cell file (mm, deg) and the robot file that it names."""
        entry = cell["robots"][robot]
        model = YAML(typ="safe").load((folder / entry["model"]).read_text())
        base, ramp = entry["base"], model["ramp_factor"]
        limits = [[np.radians(j[key]) for j in model["joints"].values()] for key in ("speed", "acceleration", "jerk")]
        capsules = [
            (c["link"], np.array(c["start"]) / 1e3, np.array(c["end"]) / 1e3, c["radius"] / 1e3)
            for c in model["capsules"]
        ]
        assert base["A"] == base["B"] == 0, "this judge knows arms that stand upright"
        return cls(
            np.array([base["X"], base["Y"], base["Z"]]) / 1e3,
            np.radians(base["C"]),
            {name: value / 1e3 for name, value in model["geometry"].items()},
            capsules,
            np.array(limits[0]),
            ramp * np.array(limits[1]),
            ramp * np.array(limits[2]),
        )

    def depth_m(self, q: Floats, centre: Floats, half: Floats) -> float:
        """How far the arm is from an upright box [m]; below 0 it is inside. Axes are sampled every 5 cm and finer."""
        frames, worst = self._frames(q), np.inf
        for link, start, end, radius in self.capsules:
            turn, origin = frames[link]
            a, b = origin + turn @ start, origin + turn @ end
            points = a + np.linspace(0.0, 1.0, 2 + int(np.linalg.norm(b - a) / 0.05))[:, None] * (b - a)
            gaps = np.linalg.norm(np.maximum(np.abs(points - centre) - half, 0.0), axis=1)
            worst = min(worst, float(gaps.min()) - radius)
        return worst

    def _frames(self, q: Floats) -> list[tuple[Floats, Floats]]:
        """Rotation and origin of links 0 to 6 in world: axes z, y, y, x, y, x, lengths as the robot file names them."""
        a = self.lengths_m
        steps = (
            ("z", (0.0, 0.0, a["a1z"])),
            ("y", (a["a2x"], 0.0, a["a2z"])),
            ("y", (0.0, 0.0, a["a3z"])),
            ("x", (a["a4x"], 0.0, a["a4z"])),
            ("y", (a["a5x"], 0.0, 0.0)),
            ("x", (a["a6x"], 0.0, 0.0)),
        )
        turn, origin = _rotation("z", self.turned_rad), self.base_m
        frames = [(turn, origin)]
        for number, ((axis, way), angle) in enumerate(zip(steps, q, strict=True)):
            # The first link's frame lies on the first axis, raised; it turns with it.
            if number == 0:
                turn = turn @ _rotation(axis, angle)
                origin = origin + turn @ np.array(way)
            else:
                origin = origin + turn @ np.array(way)
                turn = turn @ _rotation(axis, angle)
            frames.append((turn, origin))
        return frames


def _rotation(axis: str, angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    rows = {
        "x": [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]],
        "y": [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]],
        "z": [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
    }
    return np.array(rows[axis])


@dataclass
class _Seen:
    """What is remembered of one robot."""

    recent: deque[tuple[int, Floats, bool]] = field(default_factory=lambda: deque(maxlen=4))
    boot: str = ""
    inside_since: float | None = None
    stopped: tuple[float, Floats] | None = None
    """Since when it says that it is stopped, and where it stood some seconds later."""


class OutsideObserver:
    """A context manager; `breaches` holds what must not be, `counts` what was looked at."""

    def __init__(self, cell_file: Path, cycle_s: float) -> None:
        cell = YAML(typ="safe").load(cell_file.read_text())
        self._prefix = f"cell/{cell['cell']}/"
        self._cycle_s = cycle_s
        self._arms = {robot: Arm.read(cell, robot, cell_file.parent) for robot in cell["robots"]}
        self._zones = {
            name: (np.array([zone["pose"][key] for key in "XYZ"]) / 1e3, np.array(zone["size"]) / 2e3)
            for name, zone in cell["zones"].items()
        }
        gateways = {name: entry["endpoint"] for name, entry in cell["gateways"].items()}
        self._robots = {
            name: [robot for robot, e in cell["robots"].items() if e["gateway"] == name] for name in gateways
        }
        self._doors = [(cell["manager"]["endpoint"], "robot/*/state"), (cell["manager"]["endpoint"], "manager/state")]
        self._doors += [(cell["manager"]["endpoint"], "event/**")]
        for robot, entry in cell["robots"].items():
            self._doors.append((gateways[entry["gateway"]], f"robot/{robot}/drives"))
        self._sessions: list[zenoh.Session] = []
        self._subscribers: list[Any] = []
        self._lock = threading.Lock()
        self._seen = {robot: _Seen() for robot in self._arms}
        self._token = (0, 0)
        self.breaches: list[str] = []
        self.counts: Counter[str] = Counter()
        self.worst: dict[str, float] = {"speed": 0.0, "acceleration": 0.0, "together_s": 0.0}
        self.states: dict[str, tuple[float, dict[str, Any]]] = {}
        """The newest state of each robot and when it came."""
        self.manager: tuple[float, dict[str, Any]] = (0.0, {})
        self.events: deque[dict[str, Any]] = deque(maxlen=200)

    def __enter__(self) -> Self:
        by_endpoint: dict[str, zenoh.Session] = {}
        take = {"drives": self._drives, "state": self._state}
        for endpoint, key in self._doors:
            if endpoint not in by_endpoint:
                config = {
                    "mode": "client",
                    "connect": {"endpoints": [endpoint], "timeout_ms": -1, "exit_on_failure": False},
                    "scouting": {"multicast": {"enabled": False}},
                }
                by_endpoint[endpoint] = zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
            heard = self._event if key.startswith("event") else take[key.rpartition("/")[2]]
            self._subscribers.append(by_endpoint[endpoint].declare_subscriber(self._prefix + key, heard))
        self._sessions = list(by_endpoint.values())
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        for subscriber in self._subscribers:
            subscriber.undeclare()
        for session in self._sessions:
            session.close()

    def fresh(self, robot: str, within_s: float = 1.0) -> dict[str, Any] | None:
        """The robot's state, if it is that young."""
        at, state = self.states.get(robot, (0.0, {}))
        return state if time.monotonic() - at < within_s else None

    @property
    def somebody_inside(self) -> bool:
        """A body is in a zone, as far as was seen last."""
        with self._lock:
            return any(seen.inside_since is not None for seen in self._seen.values())

    def drives_start(self, gateway: str) -> None:
        """Simulated drives start where their file says: where their robots were seen last tells nothing any more."""
        with self._lock:
            for robot in self._robots[gateway]:
                self._seen[robot] = _Seen()

    # What comes in

    def _state(self, sample: zenoh.Sample) -> None:
        now, message = time.monotonic(), json.loads(sample.payload.to_string())
        with self._lock:
            if str(sample.key_expr).endswith("manager/state"):
                self._manager_said(now, message)
            else:
                self.states[message["robot"]] = (now, message)
                self.counts["states"] += 1

    def _manager_said(self, now: float, message: dict[str, Any]) -> None:
        self.manager = (now, message)
        self.counts["manager states"] += 1
        for name, zone in message["zones"].items():
            if zone["token"] is not None:
                token = (zone["token"]["epoch"], zone["token"]["counter"])
                if token > self._token:
                    self._token = token
                    self.counts["grants"] += 1
            if zone["holder"] is not None and zone["holder"] not in self._arms:
                self._breach(f"zone {name} is held by {zone['holder']!r}, whom nobody knows")

    def _event(self, sample: zenoh.Sample) -> None:
        message = json.loads(sample.payload.to_string())
        with self._lock:
            self.events.append(message)
            self.counts[f"event {message['code']}"] += 1
            if message["code"] == "zone_breach":
                self._breach(f"the manager tells of a breach: {message['text']}")

    def _drives(self, sample: zenoh.Sample) -> None:
        data, now = sample.payload.to_bytes(), time.monotonic()
        if data[:4] != b"ZDF4":
            self._breach(f"a feedback begins with {data[:4]!r}")
            return
        fields = _FEEDBACK.unpack_from(data)
        tick, flags, n, robot_length, boot_length = fields[2], fields[9], *fields[10:13]
        at = _FEEDBACK.size
        robot, boot = data[at : at + robot_length].decode(), data[at + robot_length :][:boot_length].decode()
        at += robot_length + boot_length + n
        position, _, commanded = np.frombuffer(data, "<f8", 3 * n, at).reshape(3, n)
        with self._lock:
            self.counts["feedback"] += 1
            self._judge_motion(robot, boot, tick, commanded.copy(), bool(flags & _ENABLED))
            if tick % 2 == 0:
                self._judge_place(robot, position.copy(), now)

    # What is judged

    def _breach(self, text: str) -> None:
        zones = {name: (zone["state"], zone["holder"]) for name, zone in self.manager[1].get("zones", {}).items()}
        said = {robot: (state["mode"], state["zones"]) for robot, (_, state) in self.states.items()}
        self.breaches.append(f"{time.strftime('%H:%M:%S')} {text} (zones {zones}, robots {said})")

    def _judge_motion(self, robot: str, boot: str, tick: int, commanded: Floats, enabled: bool) -> None:
        seen, arm = self._seen[robot], self._arms[robot]
        if boot != seen.boot or (seen.recent and seen.recent[-1][0] + 1 != tick):
            seen.recent.clear()
        seen.boot = boot
        seen.recent.append((tick, commanded, enabled))
        if len(seen.recent) < 3 or not all(row[2] for row in seen.recent):
            return
        series = np.array([row[1] for row in seen.recent])
        for order, what, allowed in ((1, "speed", arm.velocity), (2, "acceleration", arm.acceleration)):
            ratio = float((np.abs(np.diff(series, order, axis=0)) / self._cycle_s**order / allowed).max())
            self.worst[what] = max(self.worst[what], ratio)
            if ratio > _LIMITS:
                self._breach(f"{robot}: {what} {ratio:.2f} of its limit at tick {tick}")

    def _judge_place(self, robot: str, position: Floats, now: float) -> None:
        seen = self._seen[robot]
        inside = any(self._arms[robot].depth_m(position, *zone) < -_DEEP_M for zone in self._zones.values())
        if not inside:
            seen.inside_since = None
        elif seen.inside_since is None:
            seen.inside_since = now
            self.counts[f"{robot} in a zone"] += 1
        since = [one.inside_since for one in self._seen.values()]
        if inside and all(each is not None for each in since):
            together_s = now - max(each for each in since if each is not None)
            self.worst["together_s"] = max(self.worst["together_s"], together_s)
            if together_s > _TOGETHER_S:
                self._breach(f"both bodies are in a zone, for {together_s:.3f} s")
        self._judge_stopped(robot, seen, position, now)

    def _judge_stopped(self, robot: str, seen: _Seen, position: Floats, now: float) -> None:
        at, state = self.states.get(robot, (0.0, {}))
        if now - at > 1.0 or state["mode"] not in ("fault", "estop"):
            seen.stopped = None
        elif seen.stopped is None:
            seen.stopped = (now, position)
        elif now - seen.stopped[0] < _STANDS_AFTER_S:
            seen.stopped = (seen.stopped[0], position)
        elif (moved := float(np.abs(position - seen.stopped[1]).max())) > _STANDS_RAD:
            self._breach(f"{robot} says {state['mode']} and has moved by {moved:.3f} rad")
