"""The agent's process: Zenoh, the planning worker and the loop around `AgentCore`."""

import contextlib
import functools
import logging
import queue
import threading
import time
from collections.abc import Callable
from pathlib import Path

from cell.config.points_edit import write_point
from cell.config.problem import ConfigError
from cell.config.settings import CellSettings
from cell.config.yaml_edit import NotWritten
from cell.core import Answer, Ask, Effect, Ended, Publish, Shutdown
from cell.net.calls import Calls
from cell.net.plain import PlainSlots
from cell.net.runner import new_boot, run_core
from cell.net.session import CellSession, Link, ZenohOptions
from robot_agent.agent.core import AgentCore
from robot_agent.agent.mount_note import MountNote
from robot_agent.agent.operator.loading import (
    ProgramNotRead,
    ProgramRead,
    ReadProgram,
    mistakes_text,
    read_program,
)
from robot_agent.agent.operator.teaching import PointNotWritten, PointWritten, WritePoint
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Plan, Unplan
from robot_agent.agent.planning.worker import PlanWorker
from robot_agent.agent.program.mounted_now import NoteDoubt
from robot_agent.agent.program.plain_keys import HearKeys
from robot_agent.language import Program
from robot_agent.workspace import PlacedRobot

PERIOD_S = 0.02
_REFUSED_PATIENCE_S = 5.0
_BRAKING_PATIENCE_S = 15.0


def run_agent(
    cell: CellSettings,
    robot: str,
    placed: PlacedRobot,
    program: Program,
    options: ZenohOptions,
    folder: Path,
    stop: threading.Event,
    say: Callable[[str], None],
) -> int:
    """Run the agent of one robot until `stop` is set; returns the exit code. It keeps in `folder` what outlives it.

    On `stop` the robot brakes on its path and its claim is released before anything is closed. `say` tells people why
    the agent does not get its robot. Raises `cell.net.errors.NetError` when the session cannot be opened.
    """
    settings = cell.robots[robot]
    link = Link("peer", connect=(cell.manager_endpoint, cell.gateways[settings.gateway].endpoint), gossip=True)
    boot = new_boot()
    planner_for = functools.partial(Planner, placed)
    note = MountNote(folder, robot)
    core = AgentCore(cell, robot, planner_for, program, boot, mount_in_doubt=note.doubtful)
    with contextlib.ExitStack() as stack:
        stack.callback(note.close)
        session = stack.enter_context(CellSession(cell.name, link, "robot", robot, boot, options))
        session.tell_last(f"robot/{robot}/variables")
        shell = AgentShell(core, session, cell, robot, say, stop)
        shell.note_doubt = note.keep
        shell.start_worker = lambda *told: stack.enter_context(PlanWorker(planner_for(*told)))
        run_core(core, period_s=PERIOD_S, inbox=shell.inbox, perform=shell.perform, stop=shell.ended)
        return shell.exit_code


class AgentShell:
    """Carries the core's effects out and collects what it must hear."""

    start_worker: Callable[[float, tuple[float, ...]], PlanWorker]
    """With cycle and quick stop, as the gateway told them."""
    note_doubt: Callable[[bool], object]
    """Whether the robot may carry something else than its robot file says."""

    def __init__(
        self,
        core: AgentCore,
        session: CellSession,
        cell: CellSettings,
        robot: str,
        say: Callable[[str], None],
        stop: threading.Event,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._core = core
        self._now = now
        self._session = session
        self._robot = robot
        self._gateway = cell.robots[robot].gateway
        self._endpoint = cell.gateways[self._gateway].endpoint
        self._say = say
        self._stop = stop
        self._stopping_since: float | None = None
        self._refused_since: float | None = None
        self._said = ""
        self._worker: PlanWorker | None = None
        self._calls: Calls | None = None
        self._done: queue.SimpleQueue[PointWritten | PointNotWritten | ProgramRead | ProgramNotRead] = (
            queue.SimpleQueue()
        )
        """What became of files that were to be read or written."""
        mine = f"robot/{robot}"
        self._states = session.watch(
            "manager/state", "zone/*", "frame/*", "conveyor/*", f"{mine}/drives", f"{mine}/clearance", f"{mine}/jog",
            f"{mine}/correction/*", f"gateway/{self._gateway}/state", "manager/variables",
        )  # fmt: skip
        self._estops = session.queue("estop")
        self._plain = PlainSlots(now)
        self.ended = threading.Event()
        self.exit_code = 0

    def inbox(self) -> list[object]:
        """Everything that arrived since the last step."""
        messages: list[object] = [*self._states.take_arrived(), *self._estops.take(), *self._session.outcomes()]
        messages += self._plain.take_new()
        if self._calls is not None:
            messages.extend(self._calls.take())
        if self._worker is not None:
            messages.extend(self._worker.results())
        messages.extend(self._done.get_nowait() for _ in range(self._done.qsize()))
        self._watch_claim()
        if self._stop.is_set():
            messages.extend(self._leave())
        return messages

    def perform(self, effect: Effect) -> None:
        """Carry one effect out."""
        match effect:
            case Publish(message):
                self._session.publish(message)
            case Ask():
                self._session.ask_later(effect)
            case Answer() if self._calls is not None:
                self._calls.answer(effect)
            case Plan(request) if self._worker is not None:
                self._worker.submit(request)
            case Unplan(ids) if self._worker is not None:
                self._worker.drop(ids)
            case WritePoint():
                threading.Thread(target=self._write_point, args=(effect,), name="point", daemon=True).start()
            case ReadProgram():
                threading.Thread(target=self._read_program, args=(effect,), name="program", daemon=True).start()
            case HearKeys(keys):
                for key in keys:
                    self._session.hear(key, self._plain.store)
            case NoteDoubt(doubtful):
                self.note_doubt(doubtful)
            case Ended():
                self.ended.set()
            case _:
                logging.getLogger(__name__).error("the agent's shell cannot carry out %r", effect)

    def _write_point(self, effect: WritePoint) -> None:
        """On a thread of its own: no disk, full or slow, holds the agent's loop up."""
        try:
            settings = write_point(effect.file, effect.name, effect.point, effect.owner)
        except NotWritten as error:
            self._done.put(PointNotWritten(effect.id, str(error)))
        except Exception as error:  # whatever it is, an operator waits for the outcome
            logging.getLogger(__name__).exception("writing point %s", effect.name)
            self._done.put(PointNotWritten(effect.id, f"internal error, please report it: {error!r}"))
        else:
            self._done.put(PointWritten(effect.id, settings))

    def _read_program(self, effect: ReadProgram) -> None:
        """On a thread of its own, as `_write_point`."""
        try:
            program = read_program(effect.cell, effect.robot, effect.model, effect.file)
        except ConfigError as error:
            self._done.put(ProgramNotRead(effect.id, mistakes_text(error.problems)))
        except Exception as error:  # whatever it is, an operator waits for the outcome
            logging.getLogger(__name__).exception("reading program %s", effect.file)
            self._done.put(ProgramNotRead(effect.id, f"internal error, please report it: {error!r}"))
        else:
            self._done.put(ProgramRead(effect.id, program))

    def _watch_claim(self) -> None:
        """Serve the robot once it is ours; tell people while it is not."""
        grant = self._core.link.grant
        if grant is not None:
            self._refused_since, self._said = None, ""
            if self._calls is None:
                self._calls = self._session.serve(f"robot/{self._robot}")
                self._session.declare_alive()
            if self._worker is None:
                self._worker = self.start_worker(grant.cycle_s, grant.quick_stop)
                logging.getLogger("robot_agent").info("robot %s: taken over from %s", self._robot, self._gateway)
            return
        refusal = self._core.link.refusal
        if refusal and refusal != self._said:
            self._said = refusal
            self._say(f"robot {self._robot} waits for gateway {self._gateway} at {self._endpoint}: {refusal}")
        if not self._core.link.refused_by_gateway:
            self._refused_since = None
        elif self._refused_since is None:
            self._refused_since = self._now()
        elif self._now() - self._refused_since > _REFUSED_PATIENCE_S and self._calls is None:
            self._say(f"robot {self._robot}: giving up after {_REFUSED_PATIENCE_S:g} s of refusals")
            self.exit_code = 1
            self.ended.set()

    def _leave(self) -> list[object]:
        if self._stopping_since is None:
            self._stopping_since = self._now()
            return [Shutdown()]
        if self._now() - self._stopping_since > _BRAKING_PATIENCE_S:
            self._say(f"robot {self._robot}: not at rest after {_BRAKING_PATIENCE_S:g} s, leaving it to its gateway")
            self.exit_code = 1
            self.ended.set()
        return []
