"""A copy of the example cell in a folder of the test's own, to be spoilt; and small files of any content."""

import shutil
from pathlib import Path

from tests.unit.repository import ROOT

CONFIGS = ROOT / "cell_configs"
TWO_ARMS = CONFIGS / "two_arms" / "cell.yaml"
CELL = "two_arms/cell.yaml"
ROBOT = "models/six_axis.yaml"
DRIVES = "two_arms/left_drives.yaml"
SIMULATION = "two_arms/left_drives.sim.yaml"
TIMES = "times: {feedback_lost_s: 0.8, owner_silent_s: 2}"
"""The example's line in `CELL`."""


class Copy:
    """`cell_configs` below `folder`, with changes."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder / "cell_configs"
        shutil.copytree(CONFIGS, self.folder, ignore=shutil.ignore_patterns(".zencell"))
        self.cell = self.folder / CELL
        self.robot = self.folder / ROBOT
        self.drives = self.folder / DRIVES

    def change(self, name: str, old: str, new: str) -> "Copy":
        """Replace the one place in the file `name` that says `old`."""
        file = self.folder / name
        text = file.read_text()
        assert text.count(old) == 1, f"{name} says {old!r} {text.count(old)} times"
        file.write_text(text.replace(old, new))
        return self

    def add(self, name: str, line: str) -> "Copy":
        """Add a line at the end of the file `name`."""
        file = self.folder / name
        file.write_text(f"{file.read_text()}{line}\n")
        return self

    def slow_buses(self, cell: str = "two_arms") -> "Copy":
        """Cycles of 20 ms instead of 4, and frames that are there at once, for tests in which the bus matters less than
        the time that they take."""
        for side in ("left", "right"):
            self.change(f"{cell}/{side}_drives.yaml", "cycle_s: 0.004", "cycle_s: 0.02")
            self.change(f"{cell}/{side}_drives.sim.yaml", "wire_time: true", "wire_time: false")
        return self.change(f"{cell}/cell.yaml", "times: {", "times: {lead_s: 0.05, nominal_s: 0.16, ")

    def place(self, name: str, at: str) -> str:
        """`file:line:column` of the one place in the file `name` that reads like `at`, counted at its mark `§`."""
        text, before = (self.folder / name).read_text(), at.split("§")[0]
        context = at.replace("§", "")
        assert text.count(context) == 1, f"{name} says {context!r} {text.count(context)} times"
        lines = text[: text.index(context) + len(before)].split("\n")
        return f"{name}:{len(lines)}:{len(lines[-1]) + 1}"

    def shown(self, problem: object) -> str:
        """A problem's line without this folder."""
        return str(problem).replace(f"{self.folder}/", "")
