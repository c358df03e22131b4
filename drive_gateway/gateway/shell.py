"""The gateway's process: bus, SDO workers, Zenoh and the cycle around `GatewayCore`."""

import logging
import os
import time
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from threading import Event, Thread

from cell.config.settings import Times
from cell.core import Answer, Effect, Ended, Publish, Shutdown
from cell.messages.event import Event as CellEvent
from cell.messages.event import Severity
from cell.net.calls import Calls
from cell.net.inbox import Inbox
from cell.net.latest import Latest
from cell.net.options import Link, ZenohOptions
from cell.net.runner import SWITCH_S, Priority, new_boot, run_core, scheduling
from cell.net.session import CellSession
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.sdo import Sdo
from drive_gateway.config.settings import GatewaySettings
from drive_gateway.errors import GatewayError
from drive_gateway.gateway.bus.bus_news import BusTraffic
from drive_gateway.gateway.bus.bus_port import BusPort
from drive_gateway.gateway.bus.recorder import LONGEST_S, Recorder, RecordError
from drive_gateway.gateway.bus.sdo_workers import SdoWorkers
from drive_gateway.gateway.bus.steady_bus import Opener
from drive_gateway.gateway.core import GatewayCore
from drive_gateway.gateway.effects import (
    DrivesSlow,
    Frame,
    Record,
    RecordEnded,
    RecordSaid,
    StorePosition,
    TakeBlocks,
)
from drive_gateway.gateway.reference.position_store import PositionStore
from drive_gateway.sim.config.simulation import Simulation
from drive_gateway.sim.inner_bus import InnerBus
from drive_gateway.sim.pace import REMEDY
from drive_gateway.sim.shell import Robots, SimulatedDrives

CLOSING_S = 5.0
"""After its own e-stop delay a gateway that is stopped gets this long to switch its drives off."""
RECORDINGS = "recordings"
"""The folder below the state folder to which a gateway writes what it is asked to record, and nowhere else."""
ALONE_SWITCH_S = 2e-5
"""So long Zenoh's threads wait for the interpreter, unless the drives compute in this process too."""
_CLOCK_S = 0.25
"""The manager's state is read so often where it is only needed for its clock."""
_LOG = logging.getLogger("drive_gateway")
_LEVEL = {Severity.INFO: logging.INFO, Severity.WARNING: logging.WARNING, Severity.ALARM: logging.ERROR}


def run_gateway(
    settings: GatewaySettings,
    times: Times,
    *,
    cell: str,
    digest: str,
    link: Link,
    stop: Event,
    simulation: Simulation | None = None,
    robots: Robots | None = None,
    state_folder: Path | None = None,
    zenoh_options: ZenohOptions | None = None,
) -> int:
    """Run one gateway until `stop` is set; then play out, switch off and leave the bus.

    With a `simulation` the bus' drives run in this process too: on their own handle of the same bus, or inside the
    gateway's handle (`InnerBus`) where nobody else can be on it. They stand where it says at each start,
    so only without it `state_folder` keeps where axes stand. `robots`: the loads that they carry at the full level.

    Returns:
        0 when all drives were switched off, 1 when a drive did not say that it is off.

    Raises:
        BusError: the bus cannot be opened.
        PositionStoreError: the stored positions cannot be read.
        ValueError: the cycle is no interpolation period of a drive.
        cell.net.errors.NetError: the Zenoh session cannot be opened.
    """
    boot = new_boot()
    with ExitStack() as stack:
        store = None
        if state_folder is not None and simulation is None:
            store = stack.enter_context(PositionStore(state_folder / f"positions-{settings.name}.json"))
        core = GatewayCore(
            settings,
            times,
            boot=boot,
            digest=digest,
            first_owner=int(1000 * time.time()),
            process=f"process {os.getpid()}",
            stored={} if store is None else store.records,
        )
        # Zenoh's threads start here: on a busy host a block must not wait for a processor before the cycle sees it.
        with scheduling(Priority.FEEDING):
            session = stack.enter_context(CellSession(cell, link, "gateway", settings.name, boot, zenoh_options))
        drives, opener = None, None
        if simulation is not None and InnerBus.fits(settings, simulation):
            opener = _inside(settings, simulation, robots)
        elif simulation is not None:
            drives = stack.enter_context(SimulatedDrives(settings, simulation, robots))
        shell = GatewayShell(
            core,
            settings,
            times,
            session,
            stop,
            store,
            drives,
            open_port=partial(BusPort, opener=opener),
            recordings=None if state_folder is None else state_folder / RECORDINGS,
        )
        return shell.run()


def _inside(settings: GatewaySettings, simulation: Simulation, robots: Robots | None) -> Opener:
    """Opens a bus in this process, with its drives."""
    return lambda _bus: InnerBus(settings, simulation, robots)


class GatewayShell:
    """What the loop calls: everything that came since the last cycle, and each effect of this one."""

    def __init__(
        self,
        core: GatewayCore,
        settings: GatewaySettings,
        times: Times,
        session: CellSession,
        stop: Event,
        store: PositionStore | None,
        drives: SimulatedDrives | None = None,
        *,
        open_port: Callable[..., BusPort] = BusPort,
        open_workers: type[SdoWorkers] = SdoWorkers,
        now: Callable[[], float] = time.monotonic,
        recordings: Path | None = None,
    ) -> None:
        robots = settings.robots
        self._recordings = recordings
        self._now = now
        self._core = core
        self._settings = settings
        self._session = session
        self._calls: Calls = session.serve(f"gateway/{settings.name}")
        self._blocks: Latest = session.watch(*(f"robot/{robot}/setpoints" for robot in robots))
        self._estops: Inbox = session.queue("estop")
        self._manager: Latest = session.watch("manager/state")
        self._manager_due = 0.0
        self._stop = stop
        self._store = store
        self._closing_s = times.estop_delay_s + CLOSING_S
        self._deadline: float | None = None
        self._arrived: deque[object] = deque()
        self._simulates = drives is not None
        if drives is not None:
            drives.on_slow = lambda text: self._arrived.append(DrivesSlow(text, REMEDY))
        self.port = open_port(settings.bus, self._on_frame, self._arrived.append)
        node_ids = {axis.node_id for drives in robots.values() for axis in drives.axes}
        node_ids |= {io.node_id for io in settings.io_nodes}
        self.workers = open_workers(
            node_ids, self.port.send, self.port.attend, self._arrived.append, settings.sdo_timeout_s
        )
        self.ended = Event()
        self.exit_code = 1

    def run(self) -> int:
        """The cycle, until the gateway has left its bus; the exit code."""
        with self.port, self.workers:
            self._session.declare_alive()
            run_core(
                self._core,
                period_s=self._settings.cycle_s,
                inbox=self.inbox,
                perform=self.perform,
                stop=self.ended,
                trim=lambda: self._core.trim_s,
                ahead=self.ahead,
                switch_s=SWITCH_S if self._simulates else ALONE_SWITCH_S,
                priority=Priority.BUS,
            )
        return self.exit_code

    def inbox(self) -> list[object]:
        messages: list[object] = []
        self.port.take()
        while self._arrived:
            messages.append(self._arrived.popleft())
        messages.append(BusTraffic(self.port.bits))
        messages += self._estops.take()
        messages += self._calls.take()
        now = self._now()
        if now >= self._manager_due or self._core.setting_up or self._core.stopped:
            self._manager_due = now + _CLOCK_S
            messages += self._manager.take_arrived()
        if self._stop.is_set():
            messages += self._closing()
        return messages

    def ahead(self) -> list[object]:
        """Blocks, of which the checks take a while. Those that come later are taken in the cycle, by `TakeBlocks`.

        Simulated drives inside the process are computed by this, and not in the cycle.
        """
        self.port.take()
        return self._blocks.take_new()

    def perform(self, effect: Effect) -> None:
        match effect:
            case Frame(frame):
                self.port.send(frame)
            case TakeBlocks():
                for block in self._blocks.take_new():
                    self._core.receive(block, self._now())
            case Publish(message):
                if isinstance(message, CellEvent):
                    words = message.text, message.code, message.remedy
                    _LOG.log(_LEVEL[message.severity], "%s (%s) %s", *words, extra={"event": message})
                self._session.publish(message)
            case Sdo():
                self.workers.submit(effect)
            case Answer():
                self._calls.answer(effect)
            case Record():
                Thread(target=self._record, args=(effect,), name="recorder", daemon=True).start()
            case StorePosition(name, record) if self._store is not None:
                self._store.keep(name, record)
            case Ended():
                self.exit_code = 0
                self.ended.set()

    def _on_frame(self, frame: CanFrame) -> None:
        if not self.workers.take(frame):
            self._arrived.append(frame)

    def _record(self, order: Record) -> None:
        seconds = min(order.seconds, LONGEST_S)
        try:
            file = self._recording_file(order.file)
            recorder = Recorder(self._settings.bus, file)
        except (GatewayError, OSError) as error:
            self._arrived.append(RecordSaid(order.call_id, False, str(error)))
            return
        self._arrived.append(RecordSaid(order.call_id, True, f"the gateway writes {file} for {seconds:g} s"))
        try:
            with recorder:
                frames = recorder.run(seconds, self.ended)
        except (GatewayError, OSError) as error:
            self._arrived.append(RecordEnded(f"{file}: {error}"))
            return
        self._arrived.append(RecordEnded(f"{file} holds {frames} frames"))

    def _recording_file(self, name: str) -> Path:
        """Where a recording is written. Raises `RecordError` for names that lead out of the folder for them."""
        if self._recordings is None:
            raise RecordError("this gateway was started without a state folder, so it records nothing")
        if not name or name != Path(name).name or name.startswith("."):
            allowed = f"allowed are names of files without a folder; they are written to {self._recordings}"
            raise RecordError(f"{name!r} is no name for a recording: {allowed}")
        self._recordings.mkdir(parents=True, exist_ok=True)
        return self._recordings / name

    def _closing(self) -> list[object]:
        now = self._now()
        if self._deadline is None:
            self._deadline = now + self._closing_s
            return [Shutdown()]
        if now > self._deadline:
            _LOG.error("not all drives say that they are off; make sure of it at the machine")
            self.ended.set()
        return []
