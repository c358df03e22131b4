"""Real processes for end-to-end tests."""

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from live_cell import LiveCell


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """A test waits until its own deadlines, which say what was missing, before it is ended from outside.

    How long a soak test may take is said by who starts it: `--timeout`.
    """
    for item in items:
        said = any(item.get_closest_marker(name) for name in ("timeout", "soak"))
        if item.path.parent == Path(__file__).parent and not said:
            item.add_marker(pytest.mark.timeout(300))


@pytest.fixture(scope="session", autouse=True)
def interruptible() -> None:
    """What a shell runs in its background ignores Ctrl-C, and so would all processes that are started here."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def live(tmp_path: Path) -> Iterator[LiveCell]:
    """A copy of the example cell with two arms, on free ports, nothing started yet."""
    with LiveCell(tmp_path) as cell:
        yield cell
