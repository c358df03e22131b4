"""The course of `cell up`: bring the cell up, watch it, bring it to rest."""

import math
import sys
import threading
import time
from contextlib import ExitStack
from importlib.util import find_spec
from pathlib import Path

from rich.console import Console

from cell.commands.client.cell_view import POLL_S, CellView, Snapshot, at_rest
from cell.commands.client.connection import client_session
from cell.commands.client.display import Show
from cell.commands.errors import CommandError, quoted
from cell.commands.up.children import PAGE, Children
from cell.commands.up.fault_recorder import FaultRecorder
from cell.commands.up.orders import Orders
from cell.config.settings import CellSettings
from cell.messages import Enable, Event, Halt, Mode, ProgramState, RobotState, Run, Severity
from cell.net.errors import Unreachable
from cell.net.inbox import Inbox
from cell.net.session import CellSession
from cell.view.words import unreferenced, why

START_TIMEOUT_S = 30.0
REST_TIMEOUT_S = 6.0
_WATCH_S = 0.1
"""How often a cell is looked at once it is up."""
_SHOWN_S = 0.05
"""Of a wait; a shorter one is none for people."""
QUIET_S = 10.0
"""The same warning of the same source is shown this often at most."""
ENABLED = frozenset({Mode.READY, Mode.RUNNING, Mode.HALTED, Mode.OFF_PATH, Mode.RETURNING})
STUCK = frozenset({Mode.FAULT, Mode.ESTOP})
BROKEN_OFF = frozenset({ProgramState.FAILED, ProgramState.INTERRUPTED})


class Supervisor:
    """Watches the children and the cell from the first process to the last.

    `stop` ends the run in order, `hurry` cuts its waits short.
    """

    def __init__(
        self,
        settings: CellSettings,
        children: Children,
        console: Console,
        stop: threading.Event,
        hurry: threading.Event,
        recordings: Path,
    ) -> None:
        """`recordings`: the folder that gets what happened before each alarm."""
        self._settings = settings
        self._children = children
        self._console = console
        self._stop = stop
        self._hurry = hurry
        self._recordings = recordings
        self._started = time.monotonic()
        self._warned: dict[tuple[str, str], float] = {}
        self._page_told = False

    def run(self, *, start_programs: bool, until_done: bool) -> bool:
        """Bring the cell up and watch it until `stop`; with `until_done`, until all programs are done or one fails.

        Returns whether all programs are done. Raises `CommandError` when the cell does not come up.
        """
        with ExitStack() as stack:
            session = self._connect(stack)
            if session is None:
                return False
            self._keep_recordings(session, stack)
            view = CellView(session, self._settings, presences=False)
            events = session.queue("event/**")
            with Show(self._settings, self._console) as show:
                if not self._bring_up(session, view, events, show, start_programs):
                    self._tell_stop()
                    return False
                # Only now is it certain that these robots are ours to command; before, agents brake by themselves.
                stack.callback(self._bring_to_rest, session, view)
                run = stack.enter_context(Orders(session, Run()))
                done = self._watch(view, events, show, run if start_programs else None, until_done)
                show.update(done or view.look(), last=True)
            if done is not None:
                self._tell_waits(done)
            self._tell_stop()
            return done is not None

    def _keep_recordings(self, session: CellSession, stack: ExitStack) -> None:
        """From now on keep what happens before each alarm, where the packages for that are installed."""

        def say(text: str) -> None:
            self._console.print(text, markup=False, highlight=False, soft_wrap=True)

        if find_spec("foxglove") is None:
            say("nothing is recorded before an alarm; for that: pip install 'zencell[record]'")
            return
        try:
            bulk = stack.enter_context(client_session(self._settings, (self._settings.manager_endpoint,)))
        except Unreachable as error:
            say(f"nothing is recorded before an alarm: {error}")
            return
        stack.enter_context(FaultRecorder(self._settings, session, bulk, self._recordings, self._hurry, say))

    def _connect(self, stack: ExitStack) -> CellSession | None:
        """A client session, as soon as the manager listens; None when stopped before."""
        deadline = self._started + START_TIMEOUT_S
        while not self._stop.wait(POLL_S):
            self._no_deaths()
            try:
                return stack.enter_context(client_session(self._settings, (self._settings.manager_endpoint,)))
            except Unreachable as error:
                if time.monotonic() > deadline:
                    raise CommandError(f"the manager does not come up: {error}") from error
        self._tell_stop()
        return None

    def _no_deaths(self) -> None:
        dead = self._children.deaths()
        if dead:
            raise CommandError("\n".join(child.death_notice() for child in dead), "look above; the rest was stopped")

    def _bring_up(self, session: CellSession, view: CellView, events: Inbox, show: Show, start_programs: bool) -> bool:
        """Enable every robot; False when stopped before. Raises `CommandError` when that takes too long.

        A robot that does not know where it is stays off: the cell is up for an operator who homes it. Under an
        emergency stop that an earlier run left behind nothing is enabled; the cell is up for `cell reset`.
        """
        deadline = self._started + START_TIMEOUT_S
        with Orders(session, Enable(), START_TIMEOUT_S) as enable:
            while not self._stop.wait(POLL_S):
                self._tell_events(events, show)
                self._no_deaths()
                seen = view.look()
                show.update(seen)
                if stop_text := latched_stop(seen):
                    show.say(
                        f"{stop_text}; nothing is enabled; when the cause is gone: cell reset, then cell enable ROBOT"
                    )
                    return True
                lost = unreferenced(seen.gateways.values())
                if all(enabled(seen, name) or (name in lost and name in seen.robots) for name in self._settings.robots):
                    self._tell_enabled(show, lost, start_programs)
                    return True
                for state in seen.robots.values():
                    if state.mode is Mode.DISABLED and seen.manager is not None and state.robot not in lost:
                        enable.give(state)
                if time.monotonic() > deadline:
                    missing = "\n".join(self._missing(seen, enable.problems))
                    raise CommandError(f"the cell is not up after {START_TIMEOUT_S:.0f} s\n{missing}")
        return False

    def _tell_enabled(self, show: Show, lost: dict[str, str], start_programs: bool) -> None:
        """Say that the cell is up. Raises `CommandError` when a program should run on a robot that stays off."""
        lines = [f"robot {robot} is not referenced and stays off; {reason}" for robot, reason in lost.items()]
        if lost and start_programs:
            start = f"cell up {quoted(self._settings.file)}"
            remedy = f"start the cell without its programs: {start}; then do what is said above"
            raise CommandError("\n".join(lines), remedy)
        for line in lines:
            show.say(line)
        took = f"{time.monotonic() - self._started:.1f} s"
        enables = "; ".join(f"cell enable {robot} -f {quoted(self._settings.file)}" for robot in lost)
        show.say(f"the cell is up after {took}; after that: {enables}" if lost else f"all robots enabled after {took}")

    def _missing(self, seen: Snapshot, problems: dict[str, str]) -> list[str]:
        """What keeps the cell from being up, one line each."""
        lines = [
            f"  gateway {name}: {seen.gateways[name].problem if name in seen.gateways else 'silent'}"
            for name in self._settings.gateways
            if name not in seen.gateways or not seen.gateways[name].ready
        ]
        for name in self._settings.robots:
            state = seen.robots.get(name)
            if state is None:
                lines.append(f"  robot {name}: its agent is silent")
            elif state.mode not in ENABLED:
                lines.append(f"  robot {name}: {state.mode.value} {problems.get(name, '')} {why(state)}".rstrip())
        return lines

    def _watch(
        self, view: CellView, events: Inbox, show: Show, run: Orders | None, until_done: bool
    ) -> Snapshot | None:
        """Show the cell until it is stopped, done or in trouble; return how it was when all programs were done."""
        while not self._stop.wait(_WATCH_S):
            seen = view.look()
            show.update(seen)
            self._tell_events(events, show)
            self._tell_page(show)
            dead = self._children.deaths()
            for child in dead:
                print(child.death_notice(), file=sys.stderr)
            trouble = self._trouble(seen)
            if self._children.all_dead():
                print("every process of the cell has ended", file=sys.stderr)
                return None
            if until_done and (trouble or any(child.program.part != PAGE for child in dead)):
                print(*trouble, sep="\n", end="\n" if trouble else "", file=sys.stderr)
                return None
            if trouble:
                run = None  # after a fault or an emergency stop nothing runs again without an operator
            if run is not None and self._run_programs(seen, run, show) and until_done:
                return None
            if until_done and run is not None and self._all_done(seen, run):
                return seen
        return None

    def _run_programs(self, seen: Snapshot, run: Orders, show: Show) -> bool:
        """Order every robot that can to run its program; whether one of them will not, which is told once."""
        for state in seen.robots.values():
            if state.mode is Mode.READY and state.program.state is not ProgramState.RUNNING:
                run.give(state)
        refused = run.take_given_up()
        for robot, reason in refused.items():
            remedy = f"see to it, then: cell run {robot} -f {quoted(self._settings.file)}"
            show.say(f"robot {robot} does not run its program: {reason}; {remedy}")
        return bool(refused)

    def _tell_page(self, show: Show) -> None:
        """How the page is opened, once."""
        if self._page_told:
            return
        for line in self._children.page_addresses():
            show.say(f"page {line}")
            self._page_told = True

    def _tell_events(self, events: Inbox, show: Show) -> None:
        for event in events.take():
            if isinstance(event, Event) and self._worth_a_line(event):
                remedy = f"; {event.remedy}" if event.remedy else ""
                show.say(f"{event.severity.value}: {event.source}: {event.text}{remedy}")

    def _worth_a_line(self, event: Event) -> bool:
        """Every alarm, and a warning unless the same one was shown a moment ago."""
        now, kind = time.monotonic(), (event.source, event.code)
        repeated = now - self._warned.get(kind, -math.inf) < QUIET_S
        if event.severity is Severity.WARNING and not repeated:
            self._warned[kind] = now
        return event.severity is Severity.ALARM or (event.severity is Severity.WARNING and not repeated)

    def _all_done(self, seen: Snapshot, run: Orders) -> bool:
        return run.obeyed >= set(self._settings.robots) and all(
            name in seen.robots and seen.robots[name].program.state is ProgramState.DONE
            for name in self._settings.robots
        )

    def _trouble(self, seen: Snapshot) -> list[str]:
        """What keeps programs from ending, one line each."""
        lines = [
            f"robot {state.robot}: {state.mode.value}, program {state.program.state.value} "
            f"at line {state.program.line}: {why(state) or state.program.text}"
            for state in seen.robots.values()
            if state.mode in STUCK or state.program.state in BROKEN_OFF
        ]
        return [text, *lines] if (text := latched_stop(seen)) else lines

    def _tell_waits(self, seen: Snapshot) -> None:
        """How long everything took, and which robots stood still for a zone, and for how long."""
        print(f"all programs are done after {time.monotonic() - self._started:.1f} s")
        for name in self._settings.robots:
            waited = seen.robots[name].waited_s
            for zone in self._settings.zones:
                if (waited_s := waited.get(zone, 0.0)) >= _SHOWN_S:
                    print(f"robot {name} stood still for {waited_s:.1f} s until zone {zone} was free")

    def _tell_stop(self) -> None:
        if self._stop.is_set():
            self._console.print("stopping in order; Ctrl-C once more hurries", highlight=False)

    def _bring_to_rest(self, session: CellSession, view: CellView) -> None:
        """Halt what runs, and wait until nothing moves; a robot that is silent is left to its own deadlines."""
        deadline = time.monotonic() + REST_TIMEOUT_S
        with Orders(session, Halt(), REST_TIMEOUT_S) as halt:
            while not self._hurry.is_set() and time.monotonic() < deadline:
                moving = [state for state in view.look().robots.values() if _moves(state)]
                if not moving:
                    return
                for state in moving:
                    if state.mode is Mode.RUNNING:
                        halt.give(state)
                self._hurry.wait(POLL_S)


def _moves(state: RobotState) -> bool:
    return state.mode is Mode.RUNNING or not at_rest(state)


def enabled(seen: Snapshot, robot: str) -> bool:
    return robot in seen.robots and seen.robots[robot].mode in ENABLED


def latched_stop(seen: Snapshot) -> str:
    """Who set the cell's emergency stops and why, for people; empty when there is none."""
    estops = seen.manager.estops if seen.manager is not None else ()
    return "; ".join(f"emergency stop by {estop.by}: {estop.reason}" for estop in estops)
