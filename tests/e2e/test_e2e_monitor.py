"""`cell monitor` in a real terminal, driven by keys, on a running cell."""

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from live_cell import ROOT, LiveCell, wait_until

DEADLINE_S = 30.0
REFUSED = "the call is too old to be carried out"


class Terminal:
    """A terminal of tmux with a command in it. A context manager."""

    def __init__(self, folder: Path, *words: str) -> None:
        self._socket = folder / "tmux"
        command = f"{shlex.join([sys.executable, '-m', 'cell.commands.main', *words])}; echo ended with $?; cat"
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        self._run("new-session", "-d", "-x", "120", "-y", "40", command, environment=environment)

    def _run(self, *words: str, environment: dict[str, str] | None = None) -> str:
        done = subprocess.run(
            ["tmux", "-S", str(self._socket), "-f", "/dev/null", *words],
            env=environment, capture_output=True, text=True, check=True, timeout=DEADLINE_S,
        )  # fmt: skip
        return done.stdout

    def __enter__(self) -> "Terminal":
        return self

    def __exit__(self, *_: object) -> None:
        self._run("kill-server")

    def text(self) -> str:
        return self._run("capture-pane", "-p")

    def shows(self, *texts: str) -> None:
        wait_until(lambda: all(text in self.text() for text in texts), DEADLINE_S, lambda: f"{texts} in\n{self.text()}")

    def press(self, *keys: str) -> None:
        self._run("send-keys", *keys)

    def press_until(self, key: str, *texts: str) -> None:
        """Press a key again where its call came too late to be carried out, as on a busy computer."""

        def shown() -> bool:
            text = self.text()
            if REFUSED in text.rpartition("events,")[2]:
                self.press(key)
            return all(each in text for each in texts)

        self.press(key)
        wait_until(shown, DEADLINE_S, lambda: f"{texts} in\n{self.text()}")


@pytest.mark.skipif(shutil.which("tmux") is None, reason="there is no tmux on this computer")
def test_robots_are_seen_halted_continued_and_stopped_by_keys(live: LiveCell) -> None:
    live.up().wait_for_output("all robots enabled", DEADLINE_S)
    with Terminal(live.folder, "monitor", "--control", "-f", str(live.file)) as terminal:
        terminal.shows("SIMULATED", "> left ready", "next: start its program", "J6    Operation Enabled")
        live.obeyed("run", "left")
        live.obeyed("run", "right")
        terminal.shows("left running", "right running")
        terminal.press("Down")
        terminal.press_until("h", "> right halted", "right: right brakes on its path")
        terminal.press_until("c", "> right running")
        terminal.press("e")
        terminal.shows(
            "EMERGENCY STOP by", "left stands  right stands  gateway left_bus stands  gateway right_bus stands"
        )
        terminal.press("q")
        terminal.shows("ended with 0")
