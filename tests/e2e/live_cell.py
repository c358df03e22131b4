"""A copy of an example cell on free ports, its real processes, and what is heard from them."""

import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar

from cell.config import load_cell
from cell.messages import Call, Command, Heard, Reply, RobotState
from cell.net.options import Link
from cell.net.runner import new_boot
from cell.net.session import CellSession, new_call
from tests.ports import free_port

ROOT = Path(__file__).parents[2]
MODULES = {"cell": "main", "robot-agent": "robot_agent", "drive-gateway": "drive_gateway"}
POLL_S = 0.01
SHIPPED_CYCLE_S = 0.004
FORGIVING_TIMES = {"feedback_lost_s: 0.8, owner_silent_s: 2": "feedback_lost_s: 2.5, owner_silent_s: 5"}
FORGIVING_DRIVES = {
    "overrun_limit_s: 0.5": "overrun_limit_s: 2.0",
    "heartbeat_timeout_s: 1.0": "heartbeat_timeout_s: 3.0",
    "tpdo_timeout_s: 0.6": "tpdo_timeout_s: 2.0",
}
M = TypeVar("M")


def change(file: Path, changes: dict[str, str]) -> None:
    """Replace in a file each of these words, which must be there."""
    text = file.read_text()
    for old, new in changes.items():
        assert old in text, f"{old!r} is not in {file}"
        text = text.replace(old, new)
    file.write_text(text)


def wait_until(condition: Callable[[], M | None], timeout_s: float, what: str | Callable[[], str]) -> M:
    """The first true value of `condition`; fails with `what`, as it is then, when there is none in time."""
    deadline = time.monotonic() + timeout_s
    pause = threading.Event()
    while not (value := condition()):
        if time.monotonic() > deadline:
            raise AssertionError(f"not within {timeout_s:g} s: {what if isinstance(what, str) else what()}")
        pause.wait(POLL_S)
    return value


class Process:
    """One command, started as a user would; its output goes to a file."""

    def __init__(self, tool: str, words: tuple[str, ...], folder: Path, number: int) -> None:
        self.what = " ".join((tool, *words))
        self._log = folder / f"{number:02d}-{tool}.out"
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", f"cell.commands.{MODULES[tool]}", *words],
                cwd=ROOT,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, "PYTHONUNBUFFERED": "1", "COLUMNS": "200"},
            )

    @property
    def output(self) -> str:
        return self._log.read_text(errors="replace")

    @property
    def pid(self) -> int:
        return self._process.pid

    def exit_code(self) -> int | None:
        return self._process.poll()

    def signal(self, number: signal.Signals) -> None:
        self._process.send_signal(number)

    def wait(self, timeout_s: float) -> int:
        """Exit code; fails with the output when the process does not end."""
        try:
            return self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            raise AssertionError(f"{self.what} did not end within {timeout_s:g} s:\n{self.output}") from None

    def wait_for_output(self, text: str, timeout_s: float) -> None:
        """Wait until the process has printed `text`; fails at once when it ends without."""

        def printed() -> bool:
            ended = self.exit_code() is not None
            if text in self.output:
                return True
            assert not ended, f"{self.what} ended with {self.exit_code()}:\n{self.output}"
            return False

        wait_until(printed, timeout_s, f"{text!r} in the output of {self.what}:\n{self.output}")


class Recorder:
    """Every message on some keys, in order of arrival."""

    def __init__(self, session: CellSession, *patterns: str) -> None:
        self._inbox = session.queue(*patterns, size=20_000)
        self.messages: list[object] = []

    def take(self) -> list[object]:
        """What arrived since the last call; it is also added to `messages`."""
        new = self._inbox.take()
        self.messages += new
        return new

    def wait_for(self, kind: type[M], condition: Callable[[M], bool], timeout_s: float, what: str) -> M:
        """The next message of `kind` for which `condition` holds; fails with the last that came instead."""
        others: deque[M] = deque(maxlen=4)

        def heard() -> M | None:
            for message in self.take():
                if isinstance(message, kind):
                    if condition(message):
                        return message
                    others.append(message)
            return None

        try:
            return wait_until(heard, timeout_s, what)
        except AssertionError as late:
            raise AssertionError("\n".join([f"{late}; the last that came:", *map(repr, others)])) from None


class LiveCell:
    """A running cell of a test; leaving the `with` block ends every process that belongs to it."""

    def __init__(self, folder: Path, cycle_s: float = 0.01, cell: str = "two_arms") -> None:
        """A cell of `cell_configs`. Unless its buses cycle as shipped it leaves half of a small computer free.

        It forgives a computer that has more to do: who is silent for a second was kept from speaking.
        """
        self.folder = folder
        configs = folder / "cell_configs"
        shutil.copytree(ROOT / "cell_configs", configs, ignore=shutil.ignore_patterns(".zencell"))
        self.file = configs / cell / "cell.yaml"
        self._move_to_free_ports()
        for drives in self.file.parent.glob("*_drives.yaml"):
            change(drives, {**FORGIVING_DRIVES, f"cycle_s: {SHIPPED_CYCLE_S}\n": f"cycle_s: {cycle_s}\n"})
        for simulated in self.file.parent.glob("*_drives.sim.yaml"):
            change(simulated, {"wire_time: true": "wire_time: false"})
        change(self.file, FORGIVING_TIMES)
        self.settings = load_cell(self.file)
        self.state_dir = folder / "state"
        self._processes: list[Process] = []

    def _move_to_free_ports(self) -> None:
        text = self.file.read_text()
        for used in sorted(set(re.findall(r"127\.0\.0\.1:(\d+)", text))):
            text = text.replace(f"127.0.0.1:{used}", f"127.0.0.1:{free_port()}")
        self.file.write_text(text)

    def without_repeats(self, *robots: str) -> None:
        """Let the programs of these robots do their work once."""
        for robot in map(self.settings.robots.__getitem__, robots):
            change(robot.program, {"GOTO again 1\n": ""})

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        for process in reversed(self._processes):
            if process.exit_code() is None:
                process.signal(signal.SIGKILL)
                process.wait(10.0)
        # The children of a killed `cell up` end by themselves, in order; one test shows it, the others need not wait.
        for pid in self.pids():
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        wait_until(lambda: not self.pids(), 10.0, "the end of the children of `cell up`")

    # Processes

    def start(self, tool: str, *words: str) -> Process:
        """Start `cell`, `robot-agent` or `drive-gateway` with these words."""
        process = Process(tool, words, self.folder, len(self._processes))
        self._processes.append(process)
        return process

    def up(self, *options: str) -> Process:
        return self.start("cell", "up", str(self.file), "--state-dir", str(self.state_dir), *options)

    def manager(self) -> Process:
        return self.start("cell", "manager", str(self.file), "--state-dir", str(self.state_dir))

    def gateway(self, name: str) -> Process:
        words = ("run", str(self.file), name, "--simulate", "--state-dir", str(self.state_dir))
        return self.start("drive-gateway", *words)

    def agent(self, robot: str) -> Process:
        return self.start("robot-agent", str(self.file), robot, "--state-dir", str(self.state_dir))

    def order(self, *words: str, timeout_s: float = 30.0) -> Process:
        """An operator's command, `cell ...`, run to its end. Too late, as on a busy host, it is given again."""
        at = words.index("--") if "--" in words else len(words)
        for _ in range(3):
            process = self.start("cell", *words[:at], "-f", str(self.file), *words[at:])
            process.wait(timeout_s)
            if "too old to be carried out" not in process.output:
                break
        return process

    def obeyed(self, *words: str) -> None:
        """Give an order; it must be obeyed."""
        order = self.order(*words)
        assert order.exit_code() == 0, order.output

    def pid_of(self, *words: str) -> int:
        """Process id of the child of `cell up` whose command line has all these words."""
        found = list(self._pids(str(self.folder), *words, "--parent-pipe"))
        assert len(found) == 1, f"{len(found)} processes with {words}"
        return found[0]

    def pids(self) -> list[int]:
        """All running processes of this cell."""
        return list(self._pids(str(self.folder)))

    def kill(self, pid: int) -> None:
        """SIGKILL one process of this cell."""
        assert pid in self.pids()
        os.kill(pid, signal.SIGKILL)

    @staticmethod
    def _pids(*words: str) -> Iterator[int]:
        for entry in Path("/proc").iterdir():
            if not entry.name.isdigit() or int(entry.name) == os.getpid():
                continue
            try:
                line = (entry / "cmdline").read_bytes().decode(errors="replace").replace("\0", " ")
                zombie = ") Z " in (entry / "stat").read_text()
            except OSError:
                continue
            if not zombie and all(word in line for word in words):
                yield int(entry.name)

    # Messages

    def client(self) -> CellSession:
        """A client session at the rendezvous; open it in a `with` block once the manager listens."""
        return self._client(self.settings.manager_endpoint)

    def client_of(self, gateway: str) -> CellSession:
        """A client session at a gateway, for what happens while there is no manager."""
        return self._client(self.settings.gateways[gateway].endpoint)

    def _client(self, endpoint: str) -> CellSession:
        link = Link("client", connect=(endpoint,), open_timeout_s=30.0)
        return CellSession(self.settings.name, link, "test", new_boot(), new_boot())


def ask(session: CellSession, to: str, command: Command, heard: Heard | None, timeout_s: float = 5.0) -> Reply:
    """A call as an operator's tool makes it."""
    call: Call = new_call(command, heard)
    return session.ask(to, call, timeout_s)


def echo(state: RobotState) -> Heard:
    return Heard(state.boot, state.sequence)
