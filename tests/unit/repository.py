"""Where the files of the repository are that tests read."""

import json
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]


def vectors(name: str) -> Any:
    """The worked numbers of a file of `tests/vectors`."""
    return json.loads((ROOT / "tests" / "vectors" / name).read_text())
