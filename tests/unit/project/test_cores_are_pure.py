"""Cores open no socket, start no thread and read no clock: only shells may import what does."""

import ast
from pathlib import Path

import pytest

from tests.unit.repository import ROOT

PACKAGES = ("cell", "robot_agent", "drive_gateway")
FORBIDDEN = {
    "zenoh",
    "can",
    "canopen",
    "threading",
    "time",
    "sqlite3",
    "socket",
    "multiprocessing",
    "subprocess",
    "asyncio",
}
SHELLS = {
    "cell/commands/": "the composition root",
    "cell/manager/shell.py": "the manager's process",
    "cell/manager/edits_on_disk.py": "the thread that writes the cell file",
    "cell/manager/journal.py": "the manager's file",
    "cell/manager/event_store.py": "the file of events",
    "cell/manager/event_recorder.py": "the thread that stores events",
    "cell/view/source.py": "the clock of what arrives",
    "cell/view/server.py": "the port of the page",
    "cell/view/jog_button.py": "the loop on which a browser's signs come",
    "cell/view/page.py": "the loop that draws",
    "robot_agent/agent/shell.py": "the agent's process",
    "robot_agent/agent/planning/worker.py": "the planning process",
    "drive_gateway/gateway/shell.py": "the gateway's process",
    "drive_gateway/gateway/bus/opening.py": "python-can",
    "drive_gateway/gateway/bus/own_frames.py": "a filter on python-can's socket",
    "drive_gateway/gateway/bus/bus_port.py": "the reader's thread",
    "drive_gateway/gateway/bus/steady_bus.py": "python-can, and pauses between its attempts",
    "drive_gateway/gateway/bus/sdo_workers.py": "the threads that wait for SDOs",
    "drive_gateway/gateway/bus/sdo_transfer.py": "the waits of the canopen client",
    "drive_gateway/gateway/bus/recorder.py": "writes frames to a file",
    "drive_gateway/canopen/abort_text.py": "canopen's names of abort codes",
    "cell/recording/ring.py": "filled on the thread on which payloads arrive",
    "drive_gateway/canopen/axes_eds.py": "canopen's reader of EDS files",
    "drive_gateway/canopen/eds.py": "canopen's numbers of data types",
    "drive_gateway/config/checks.py": "asks python-can for its interfaces",
    "drive_gateway/sim/inner_bus.py": "a bus of python-can, and the times of its frames",
    "drive_gateway/sim/shell.py": "the process of the simulated drives",
    "drive_gateway/sim/services/dictionary.py": "canopen's reader of EDS files",
}
"""What is no core, and why. In `cell/net` the rule is the other way round: it is a shell but for the names below."""
PURE_NET = {"keys.py", "codec.py", "binary.py", "estops.py", "freshness.py", "errors.py"}


def is_core(path: str) -> bool:
    if path.startswith("cell/net/"):
        return Path(path).name in PURE_NET
    return not any(path.startswith(shell) for shell in SHELLS)


CORES = sorted(
    path
    for package in PACKAGES
    for file in (ROOT / package).rglob("*.py")
    if is_core(path := file.relative_to(ROOT).as_posix())
)


def imports(path: str) -> set[str]:
    """The top-level names of every module that a file imports, wherever in the file it does."""
    found: set[str] = set()
    for node in ast.walk(ast.parse((ROOT / path).read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.split(".")[0])
    return found


@pytest.mark.parametrize("path", CORES)
def test_a_core_imports_nothing_of_the_outside_world(path: str) -> None:
    assert imports(path) & FORBIDDEN == set()


def test_the_cores_of_all_processes_are_looked_at() -> None:
    expected = {
        "cell/core.py",
        "cell/manager/core.py",
        "cell/manager/zones.py",
        "cell/net/freshness.py",
        "drive_gateway/gateway/core.py",
        "robot_agent/agent/core.py",
    }
    assert expected <= set(CORES)
