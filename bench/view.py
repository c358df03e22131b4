"""What the page costs: its processor time with one browser, beside `viser` alone with as many moving nodes.

`python -m bench.view page|bare ROBOTS` is the process that is measured; it prints where it listens. Its messages are
decoded from bytes as they would come, without a network.
"""

import io
import re
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import trimesh
import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from bench.load import used
from bench.timing import Row
from cell.config import load_cell
from cell.config.settings import CellSettings
from cell.core import Arrived
from cell.messages import (
    AxisStatus,
    Body,
    BusCounters,
    DriveFeedback,
    GatewayState,
    GovernorStatus,
    ManagerState,
    Mode,
    PlayoutState,
    Presence,
    ProgramState,
    ProgramStatus,
    RobotState,
)
from cell.net.codec import decode, encode
from cell.view.gate import Gate, Level
from cell.view.page import PICTURE_S, Page
from cell.view.rows import Axes
from cell.view.server import GatedServer, listen

CELL = Path(__file__).parents[1] / "cell_configs" / "two_arms" / "cell.yaml"
ALLOWED = {2: 0.08, 8: 0.15}
"""Of a core more than `viser` alone, by the number of robots."""
SETTLE_S = 5.0
CAPSULES, POSES, MOMENTS = 7, 12, 60
_FREE_FROM = 18700
"""`viser` takes the first port that is free from here on."""
NODES = 4
"""Of each robot that move in every picture: cylinders and balls of its body, and of that at rest."""
_CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, 0.0, 5.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 700,
    "image_width": 1000,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}
"""By its first word of where it looks from a browser counts as connected."""
_STATES_EVERY = 3
"""Pictures between two states of a robot."""


def view(seconds: float = 20.0) -> list[Row]:
    """Two robots and eight, thirty pictures a second."""
    rows = []
    for robots, allowed in ALLOWED.items():
        page, bare = (_share(what, robots, seconds) for what in ("page", "bare"))
        what = f"page, {robots} robots, more than bare viser ({100.0 * bare:.1f} %), per second"
        rows.append(Row(what, page - bare, (page - bare) / allowed, f"of {100.0 * allowed:g} % of a core"))
    return rows


def _share(what: str, robots: int, seconds: float) -> float:
    """Processor time per second of a process that shows so many robots to one browser."""
    words = [sys.executable, "-u", "-m", "bench.view", what, str(robots)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            with _browser(process.stdout.readline().strip()):
                time.sleep(SETTLE_S)
                (found,) = used([process.pid], seconds)
                return found.seconds / seconds
        finally:
            process.kill()


@contextmanager
def _browser(address: str) -> Iterator[None]:
    """Takes what a page sends, and draws nothing."""
    host = re.sub(r"/.*", "", address.removeprefix("ws://"))
    protocol = Subprotocol(f"viser-v{viser.__version__}")
    with connect(address, origin=Origin(f"http://{host}"), subprotocols=[protocol], max_size=None) as socket:
        socket.send(msgspec.msgpack.encode(_CAMERA))
        ended = threading.Event()

        def take() -> None:
            while not ended.is_set():
                try:
                    socket.recv(timeout=0.2)
                except TimeoutError:
                    continue
                except ConnectionClosed:
                    return

        taker = threading.Thread(target=take)
        taker.start()
        try:
            yield
        finally:
            ended.set()
            taker.join()


def _settings(robots: int) -> CellSettings:
    cell = load_cell(CELL)
    first = next(iter(cell.robots.values()))
    return replace(cell, robots={f"robot_{i}": replace(first, name=f"robot_{i}") for i in range(robots)})


class _Cell:
    """Robots that move, as bytes."""

    def __init__(self, robots: tuple[str, ...]) -> None:
        self._picture = 0
        self._moving = [[encode(message) for name in robots for message in _moving(name, i)] for i in range(MOMENTS)]
        states = [*map(_state, robots), ManagerState("two_arms", "m", 1, 1, 1.0, "d"), _gateway()]
        self._states = [(type(each), encode(each)) for each in states]

    def now(self) -> float:
        return time.monotonic()

    def take_new(self) -> list[Arrived]:
        self._picture += 1
        now = self.now()
        kinds = (Presence, DriveFeedback)
        moving = self._moving[self._picture % MOMENTS]
        found: list[object] = [decode(kinds[i % 2], data) for i, data in enumerate(moving)]
        if self._picture % _STATES_EVERY == 0:
            found += [decode(kind, data) for kind, data in self._states]
        return [Arrived(each, now) for each in found]


def _moving(name: str, moment: int) -> tuple[Presence, DriveFeedback]:
    random = np.random.default_rng(1)
    shape = random.uniform(-1.0, 1.0, (CAPSULES, 2, 3)) + 3.0 * int(name.rsplit("_", 1)[1])
    at = np.sin(2.0 * np.pi * (moment + np.arange(POSES)) / MOMENTS)
    poses = (shape + 0.1 * at[:, None, None, None]).astype(np.float32)
    radii, growth = np.full(CAPSULES, 0.1, np.float32), np.full(POSES, 0.01, np.float32)
    body = Body(True, (0.0, 0.0, 0.0), 2.0, radii, poses, growth, poses[:, -1, 1])
    axes = np.full(6, at[0])
    enabled = (AxisStatus.OPERATION_ENABLED,) * 6
    return Presence(name, "b", 1, 1, None, "d", body, 0.5), DriveFeedback(
        name, "g", 1, 5, 1, 1, PlayoutState.PLAYING, 9, 0, True, True, axes, axes, axes, enabled
    )


def _state(name: str) -> RobotState:
    program = ProgramStatus(f"{name}.prog", ProgramState.RUNNING, 8, "ML X=1650")
    place = (1.0, 0.0, 0.5), (0.0, 0.0, 0.0, 1.0)
    return RobotState(name, "b", 1, Mode.RUNNING, program, (0.0,) * 6, *place, 0.25, GovernorStatus(1.0, 0.4, 2.0, ""))


def _gateway() -> GatewayState:
    counters = BusCounters(1000, 2, 0.001, 0, 0, 0, 0.25)
    return GatewayState("left_bus", "g", 1, 0.004, "virtual", True, "", {}, None, (), counters)


def _page(robots: int) -> None:
    """The page as `cell view` has it."""
    listener = listen("127.0.0.1", 0)
    gate = Gate(("127.0.0.1",), Level.WATCH)
    server, settings = GatedServer(gate, listener), _settings(robots)
    names = tuple(settings.robots)
    axes = {name: Axes(tuple(f"J{i}" for i in range(1, 7)), (False,) * 6) for name in names}
    print(f"ws://127.0.0.1:{listener.getsockname()[1]}/?token={gate.tokens[Level.WATCH]}")
    Page(server, settings, _Cell(names), axes).run(threading.Event())


def _bare(robots: int) -> None:
    """`viser` alone, with as many nodes that move and are as large."""
    with redirect_stdout(io.StringIO()):
        server = viser.ViserServer(host="127.0.0.1", port=_FREE_FROM, verbose=False)
    cylinder = trimesh.creation.cylinder(radius=1.0, height=1.0, sections=20)
    turns = np.tile([1.0, 0.0, 0.0, 0.0], (8, 1))
    nodes = [
        server.scene.add_batched_meshes_simple(
            f"/{i}", cylinder.vertices, cylinder.faces, turns, np.zeros((8, 3)), batched_scales=np.ones((8, 3))
        )
        for i in range(robots * NODES)
    ]
    print(f"ws://127.0.0.1:{server.get_port()}/")
    due, turn = time.monotonic(), 0
    while True:
        places = np.full((8, 3), np.sin(turn), np.float32)
        with server.atomic():
            for node in nodes:
                node.batched_positions = places
                node.batched_scales = 1.0 + np.abs(places)
        turn += 1
        due = max(due + PICTURE_S, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))


if __name__ == "__main__":
    {"page": _page, "bare": _bare}[sys.argv[1]](int(sys.argv[2]))
