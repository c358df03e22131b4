"""A planted fault: a patch by text, and the tree that has it."""

import shutil
from dataclasses import dataclass
from enum import Enum
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("cell", "robot_agent", "drive_gateway", "tests", "cell_configs")


@dataclass(frozen=True, slots=True)
class Edit:
    """In `file`, relative to the root, the one place that reads `old` reads `new`."""

    file: str
    old: str
    new: str


class Bench(Enum):
    """Where a fault is looked for: a module with seeds, how many, and which."""

    CELL = "tests.sim.search", 32
    """Whole generated cells, one of them a room and one a row."""
    ROOM = "tests.sim.search", 128, "--rooms"
    """Whole generated cells without zones; one in eight is one, so these are 16 runs."""
    LINE = "tests.sim.space_checker", 5_000
    """Two robots on a line of places: for the rules of cleared space that need more messages to be lost than cells
    do."""
    CONDITIONS = "tests.sim.condition_checker", 40
    """One agent with programs that ask and count."""
    BODY = "tests.sim.body_checker", 160
    """One body at a time among things and spaces, against brute force."""
    SCENE = "tests.sim.scenes", 14
    """Whole cells in which one certain thing happens that generated cells hardly ever come to."""
    SITUATION = "tests.sim.situations", 8
    """The simulation's own tests of drives, I/O nodes, set-up, belts and shared room, by files."""

    def __init__(self, module: str, seeds: int, *options: str) -> None:
        self._module, self._seeds, self._options = module, seeds, options

    def command(self, *, harmless: bool) -> tuple[str, ...]:
        """What looks for a fault; for one that is known to be harmless in a quarter of the runs alone."""
        seeds = self._seeds // 4 if harmless else self._seeds
        return ("-m", self._module, "--seeds", f"0:{seeds}", *self._options)


@dataclass(frozen=True, slots=True)
class Mutant:
    """A fault with a short name, what goes wrong by it in words, and its edits."""

    name: str
    says: str
    edits: tuple[Edit, ...]
    harmless: str = ""
    """Why no run shows it, in a sentence: nobody could see it, or only a test of its own does. Empty: it must be
    found."""
    bench: Bench = Bench.CELL


class DoesNotApply(Exception):
    """The text that a mutant replaces is not there exactly once: the code has moved, move the mutant along."""

    def __init__(self, mutant: Mutant, edit: Edit, count: int) -> None:
        super().__init__(f"{mutant.name}: {edit.file} has {count} places that read {edit.old!r}; needed is exactly one")


def check_applies(mutant: Mutant, root: Path = ROOT) -> None:
    """Raises `DoesNotApply`."""
    for edit in mutant.edits:
        count = (root / edit.file).read_text().count(edit.old)
        if count != 1:
            raise DoesNotApply(mutant, edit, count)


def plant(mutant: Mutant | None, into: Path) -> None:
    """Copy the tree to `into` and patch it there (`None`: as it is). Raises `DoesNotApply`."""
    for package in PACKAGES:
        shutil.copytree(ROOT / package, into / package, ignore=shutil.ignore_patterns(".zencell"))
    if mutant is None:
        return
    check_applies(mutant, into)
    for edit in mutant.edits:
        file = into / edit.file
        file.write_text(file.read_text().replace(edit.old, edit.new))
