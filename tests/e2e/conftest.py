"""Real processes for end-to-end tests."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from live_cell import LiveCell


@pytest.fixture
def live(tmp_path: Path) -> Iterator[LiveCell]:
    """A copy of the example cell with two arms, on free ports, nothing started yet."""
    with LiveCell(tmp_path) as cell:
        yield cell
