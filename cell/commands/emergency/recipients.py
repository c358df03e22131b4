"""Whom an emergency stop must reach, and where: by a cell file in any state, or by what the cell's processes stored."""

import json
import os
import re
import stat
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cell.config.settings import CellSettings

STORED = "emergency_stop.json"
"""In the state folder of a cell, written by each of its processes when it starts."""
DELAY_S = 2.0
"""`estop_delay_s` of a cell that does not say."""
_LONGEST_DELAY_S = 60.0
"""A stored delay above this is damage: the command would wait for ever."""
_MOST_BYTES = 1_000_000
_QUOTED_OR_COMMENT = re.compile(r"""(?<![^\s:,\[{])(?:"(?:\\.|[^"\\\n])*"|'(?:''|[^'\n])*'|#[^\n]*)""")
_BEFORE = r"\s*(?:[&!|>]\S{0,100}\s+){0,3}[\"']?"
"""Anchor, tag, or the sign of a block, in front of a value."""
_CELL = re.compile(rf"^\{{?[ \t]*[\"']?cell[\"']?\s*:{_BEFORE}(\w[^\n\"',}}]*)", re.MULTILINE)
_NO_NAME = re.compile(r"[/*$?#]")
"""What a name in a key of Zenoh cannot have."""
_ENDPOINT = re.compile(rf"(?:endpoint[\"']?\s*:|&\w+){_BEFORE}([a-z]+/[^\s\"',}}]+)")
"""What has an anchor may be named as an endpoint elsewhere."""
_BYTE_ORDER_MARKS = "\ufeff\ufffd"


@dataclass(frozen=True, slots=True)
class Recipients:
    """A cell, as far as it is known: empty is what nobody has told."""

    cell: str
    endpoints: tuple[str, ...]
    robots: tuple[str, ...] = ()
    gateways: tuple[str, ...] = ()
    estop_delay_s: float = DELAY_S

    def members(self) -> list[tuple[str, str]]:
        """Role and name of everyone who must confirm a stop."""
        return [*(("robot", robot) for robot in self.robots), *(("gateway", gateway) for gateway in self.gateways)]


def recipients_of(settings: "CellSettings") -> Recipients:
    """What the settings of a cell say."""
    gateways = settings.gateways
    return Recipients(
        settings.name,
        (settings.manager_endpoint, *(gateway.endpoint for gateway in gateways.values())),
        tuple(settings.robots),
        tuple(gateways),
        settings.times.estop_delay_s,
    )


def store(folder: Path, recipients: Recipients) -> None:
    """Keep it for an emergency stop whose cell file cannot be used. Raises `OSError`."""
    file = folder / f"{STORED}.{os.getpid()}"
    file.write_text(json.dumps(asdict(recipients)), encoding="utf-8")
    file.replace(folder / STORED)


def stored(folder: Path) -> Recipients | None:
    """What was stored in a state folder; None where nothing is that can be used."""
    try:
        found = json.loads(_text(folder / STORED))
        endpoints, robots, gateways = (_texts(found[key]) for key in ("endpoints", "robots", "gateways"))
        known = Recipients(str(found["cell"]), endpoints, robots, gateways, float(found["estop_delay_s"]))
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError):
        return None
    usable = _name(known.cell) and 0.0 < known.estop_delay_s <= _LONGEST_DELAY_S
    return known if usable else None


def read_leniently(file: Path) -> Recipients:
    """Name and endpoints of a cell file, as far as it shows them, whatever else stands in it."""
    text = _QUOTED_OR_COMMENT.sub(_without_comment, _text(file))
    name = _CELL.search(text)
    return Recipients(_name(name[1].strip()) if name is not None else "", tuple(dict.fromkeys(_ENDPOINT.findall(text))))


def read_strictly(file: Path) -> Recipients | None:
    """The whole cell file, for who belongs to the cell; None when it is refused. Takes half a second."""
    if not _text(file):
        return None
    try:
        from cell.config import load_cell_alone

        return recipients_of(load_cell_alone(file))
    except Exception:
        return None


def stored_beside(file: Path, state_dir: Path | None, said: Recipients) -> list[Recipients]:
    """What was stored of the cell of which a cell file `said` something, or of all beside it if it says too little."""
    try:
        folders = [state_dir] if state_dir is not None else sorted((file.parent / ".zencell").iterdir())
    except OSError:
        return []
    found = [each for each in map(stored, folders) if each is not None]
    if state_dir is not None or not said.cell or not said.endpoints:
        return [each for each in found if not said.cell or each.cell == said.cell] or found
    return [each for each in found if each.cell == said.cell or set(each.endpoints) & set(said.endpoints)]


def _without_comment(found: re.Match[str]) -> str:
    """Nothing instead of a comment. One with half a pair of quotes may be the end of a text of several lines."""
    text = found[0]
    return text if text[0] != "#" or any(text.count(quote) % 2 for quote in "\"'") else ""


def _name(text: str) -> str:
    """The name of a cell; empty when it can be none, so that its doors are asked who is there."""
    return "" if _NO_NAME.search(text) else text


def _texts(found: object) -> tuple[str, ...]:
    """A list of texts. Raises `TypeError`."""
    if not isinstance(found, list) or not all(isinstance(each, str) for each in found):
        raise TypeError(found)
    return tuple(found)


def _text(file: Path) -> str:
    """The beginning of a file as text; empty when it cannot be read or is no file.

    Without zeros it is also that of UTF-16 and UTF-32, as far as it is ASCII.
    """
    try:
        if not stat.S_ISREG(file.stat().st_mode):
            return ""
        with file.open("rb") as opened:
            text = opened.read(_MOST_BYTES).replace(b"\0", b"").decode("utf-8", "replace")
            return text.lstrip(_BYTE_ORDER_MARKS)
    except (OSError, ValueError):
        return ""
