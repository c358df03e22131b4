"""The processes that `cell up` starts, and the order in which they end."""

import os
import shlex
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

from cell.config.settings import CellSettings

END_TIMEOUT_S = 10.0
"""A process that has not ended this long after it was told to is killed."""
HURRIED_TIMEOUT_S = 2.0
LAST_LINES, LAST_BYTES = 8, 16_384
"""How much of its log is shown of a process that died."""
PAGE = "view"
"""The part of a cell without which it goes on."""


@dataclass(frozen=True, slots=True)
class ChildProgram:
    """What to start: `part` names it for people, `command` is what they would type, `module` is what runs."""

    part: str
    module: str
    arguments: tuple[str, ...]
    command: str


class Child:
    """A running process in its own process session, so that Ctrl-C reaches it only through us, in our order."""

    def __init__(self, program: ChildProgram, log_folder: Path) -> None:
        self.program = program
        self.log = log_folder / f"{program.part.replace(' ', '-')}.log"
        ours, self._pipe = os.pipe()
        with self.log.open("ab") as log:
            self._log_begin = log.tell()
            self._process = subprocess.Popen(
                [sys.executable, "-m", program.module, *program.arguments, "--parent-pipe", str(ours)],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
                pass_fds=(ours,),
                env={**os.environ, "PYTHONUNBUFFERED": "1"},
            )
        os.close(ours)

    def exit_code(self) -> int | None:
        """Exit code (negative: the signal that killed it), None while it runs."""
        return self._process.poll()

    def tell_to_stop(self) -> None:
        if self.exit_code() is None:
            self._process.terminate()

    def ended_in_order(self) -> bool:
        """Whether it ended as it should after `tell_to_stop`; SIGTERM ends one that still imports its modules."""
        return self.exit_code() in (0, -signal.SIGTERM)

    def kill(self) -> None:
        self._process.kill()
        self._process.wait()

    def close(self) -> None:
        """Close our end of the pipe, which also tells the process to stop."""
        os.close(self._pipe)

    def end_notice(self) -> str:
        """How it ended, and its last lines."""
        code = self.exit_code()
        how = f"was killed by signal {-code}" if code is not None and code < 0 else f"ended with exit code {code}"
        quoted = "".join(f"\n    | {line}" for line in self.said()[-LAST_LINES:])
        return f"{self.program.part} {how}{quoted or f'; {self.log} has nothing of this run; has its disk room?'}"

    def said(self) -> list[str]:
        """The last that it printed in this run; a log that was rotated meanwhile is all its own."""
        with self.log.open("rb") as log:
            size = log.seek(0, os.SEEK_END)
            log.seek(max(self._log_begin if self._log_begin <= size else 0, size - LAST_BYTES))
            return log.read().decode(errors="replace").splitlines()

    def death_notice(self) -> str:
        """How it ended, its last lines, and the command that starts it again."""
        return f"{self.end_notice()}\n  start it again with: {self.program.command}"


def page_program(settings: CellSettings, words: tuple[str, ...]) -> ChildProgram:
    """The page about a cell; `words`: of its options."""
    arguments = ("view", "-f", str(settings.file), *words)
    return ChildProgram(PAGE, "cell.commands.main", arguments, shlex.join(("cell", *arguments)))


def programs(
    settings: CellSettings, state_dir: Path | None, simulate: bool, log_json: bool = False
) -> list[ChildProgram]:
    """Manager, gateways and agents of a cell, in the order in which they start."""
    file = str(settings.file)
    where = [] if state_dir is None else ["--state-dir", str(state_dir)]
    where += ["--log-json"] * log_json
    drives = ("--simulate",) if simulate else ()
    wanted = [("manager", "cell", ("manager", file))]
    wanted += [(f"gateway {name}", "drive-gateway", ("run", file, name, *drives)) for name in settings.gateways]
    wanted += [(f"robot {name}", "robot-agent", (file, name)) for name in settings.robots]
    modules = {"cell": "main", "drive-gateway": "drive_gateway", "robot-agent": "robot_agent"}
    return [
        ChildProgram(
            part, f"cell.commands.{modules[tool]}", (*arguments, *where), shlex.join((tool, *arguments, *where))
        )
        for part, tool, arguments in wanted
    ]


class Children:
    """All processes of a cell; leaving the `with` block stops whoever is left."""

    def __init__(
        self, wanted: list[ChildProgram], log_folder: Path, hurry: threading.Event, say: Callable[[str], None]
    ) -> None:
        self._wanted = wanted
        self._log_folder = log_folder
        self._hurry = hurry
        self._say = say
        self._children: list[Child] = []
        self._reported: set[Child] = set()
        self._out_of_order: set[Child] = set()

    def __enter__(self) -> Self:
        for program in self._wanted:
            self._children.append(Child(program, self._log_folder))
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        self._stop_in_order()
        for child in self._children:
            child.close()

    def deaths(self) -> list[Child]:
        """Those who ended since the last look."""
        dead = [child for child in self._children if child not in self._reported and child.exit_code() is not None]
        self._reported.update(dead)
        return dead

    def all_dead(self) -> bool:
        """Nothing of the cell lives any more; a page may."""
        return all(child.exit_code() is not None for child in self._children if child.program.part != PAGE)

    def page_addresses(self) -> list[str]:
        """What the page has said of how it is opened; empty without a page, or before it has."""
        pages = [child for child in self._children if child.program.part == PAGE]
        return [line for child in pages for line in child.said() if line.startswith("to ")]

    def out_of_order(self) -> list[str]:
        """After the `with` block: the processes that died by themselves, had to be killed or ended with an error."""
        return [child.program.part for child in self._children if child in self._out_of_order]

    def _stop_in_order(self) -> None:
        """The page, agents, gateways, the manager; each group has ended before the next is told to."""
        for role in (PAGE, "robot", "gateway", "manager"):
            group = [child for child in self._children if child.program.part.split()[0] == role]
            self._out_of_order.update(child for child in group if child.exit_code() is not None)
            for child in group:
                child.tell_to_stop()
            self._wait_for(group)
            for child in self.deaths():
                if not child.ended_in_order():
                    self._say(child.end_notice())
            self._out_of_order.update(child for child in group if not child.ended_in_order())

    def _wait_for(self, group: list[Child]) -> None:
        told = time.monotonic()
        pause = threading.Event()
        while any(child.exit_code() is None for child in group):
            limit = HURRIED_TIMEOUT_S if self._hurry.is_set() else END_TIMEOUT_S
            if time.monotonic() - told > limit:
                break
            pause.wait(0.02)
        for child in group:
            if child.exit_code() is None:
                child.kill()
                self._reported.add(child)
                self._say(f"{child.program.part} did not end within {limit:.0f} s and was killed; its log: {child.log}")
