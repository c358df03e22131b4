"""The newest state of a running cell, as a client of the cell hears it."""

import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from cell.config.settings import CellSettings
from cell.messages import GatewayState, Heard, ManagerState, Presence, RobotState
from cell.net.session import CellSession

SILENT_AFTER_S = 1.0
"""A process whose newest state is older than this does not answer."""

POLL_S = 0.02


@dataclass(frozen=True, slots=True)
class Snapshot:
    """What was heard within the last `SILENT_AFTER_S`; what is missing here is silent."""

    robots: dict[str, RobotState] = field(default_factory=dict)
    presences: dict[str, Presence] = field(default_factory=dict)
    gateways: dict[str, GatewayState] = field(default_factory=dict)
    manager: ManagerState | None = None


_STATES = ("robot/*/state", "gateway/*/state", "manager/state")


class Listening:
    """The newest states of a cell, as its messages come in, live or from a recording."""

    def __init__(self, settings: CellSettings) -> None:
        self._settings = settings
        self._heard: dict[tuple[type, str], tuple[object, float]] = {}

    def hear(self, message: object, at: float) -> None:
        """Take a message that came in at `at` [s]."""
        if isinstance(message, RobotState | Presence | GatewayState | ManagerState):
            self._heard[type(message), _name(message)] = (message, at)

    def snapshot(self, now: float) -> Snapshot:
        """What is not silent at `now`, by the same clock."""
        fresh = [message for message, at in self._heard.values() if now - at <= SILENT_AFTER_S]
        managers = [message for message in fresh if isinstance(message, ManagerState)]
        return Snapshot(
            robots={m.robot: m for m in fresh if isinstance(m, RobotState) and m.robot in self._settings.robots},
            presences={m.robot: m for m in fresh if isinstance(m, Presence) and m.robot in self._settings.robots},
            gateways={m.gateway: m for m in fresh if isinstance(m, GatewayState)},
            manager=managers[0] if managers else None,
        )


class CellView:
    """Watches every robot, every gateway and the manager of a cell through one open session.

    `presences`: the largest messages; who needs none should not let them come.
    """

    def __init__(self, session: CellSession, settings: CellSettings, *, presences: bool = True) -> None:
        self._states = session.watch(*_STATES, *(("robot/*/presence",) if presences else ()))
        self._listening = Listening(settings)

    def look(self) -> Snapshot:
        """What the cell says now; cheap, call it as often as needed."""
        now = time.monotonic()
        for message in self._states.take_new():
            self._listening.hear(message, now)
        return self._listening.snapshot(now)

    def wait_for(
        self, condition: Callable[[Snapshot], bool], timeout_s: float, stop: threading.Event | None = None
    ) -> Snapshot:
        """Look until `condition` holds, `timeout_s` have passed or `stop` is set; return the newest snapshot."""
        deadline = time.monotonic() + timeout_s
        pause = stop or threading.Event()
        while not condition(snapshot := self.look()) and time.monotonic() < deadline:
            if pause.wait(POLL_S):
                break
        return snapshot


def echo(state: RobotState | ManagerState | GatewayState) -> Heard:
    """What a call must carry to be taken as one that was made in view of `state`."""
    return Heard(boot=state.boot, sequence=state.sequence)


def at_rest(state: RobotState) -> bool:
    """The robot's commanded position does not change: path time stands still, or has come to the motion's end."""
    governor = state.governor
    still = governor is None or governor.rate == 0.0 or governor.tau_s >= governor.duration_s
    return still and not state.tcp_speed_m_s


def _name(message: object) -> str:
    for attribute in ("robot", "gateway", "cell"):
        name = getattr(message, attribute, None)
        if isinstance(name, str):
            return name
    raise TypeError(f"{type(message).__name__} names nobody")


def names(items: Iterable[str]) -> str:
    """A list for people: `left, right`."""
    return ", ".join(items)
