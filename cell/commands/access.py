"""What an account is to ask of a cell by its commands: the levels of the page, by a setting of its environment.

It keeps people from mistakes and nobody from malice: whoever can set a variable can take it away, and whoever reaches
the cell's Zenoh endpoint can send what he likes.
"""

import os

from cell.commands.errors import CommandError
from cell.view.gate import Level

VARIABLE = "ZENCELL_ACCESS"
_ALLOWS = {
    Level.WATCH: "what shows the cell, its files and its recordings, `cell halt` and `cell estop`",
    Level.OPERATE: "that, and whatever moves robots, ends trouble and starts processes, but nothing that stays set",
}
"""Of each level but the highest."""


def granted() -> Level:
    """The level of this account: the highest without a setting. Raises `CommandError` for one that is no level."""
    word = os.environ.get(VARIABLE, "")
    if not word:
        return Level.CONFIGURE
    found = next((level for level in Level if level.name.lower() == word), None)
    if found is None:
        levels = ", ".join(level.name.lower() for level in Level)
        raise CommandError(
            f"{VARIABLE}={word} in the environment, allowed are {levels}", "set one of these, or none", 2
        )
    return found


def require(level: Level, what: str) -> None:
    """Raise `CommandError` where this account has less than `level`; `what` is what it asked for."""
    mine = granted()
    if mine < level:
        raise CommandError(
            f"{what} needs the level {level.name.lower()}, and this account has {mine.name.lower()} ({VARIABLE}); "
            "nothing was sent",
            f"allowed here: {_ALLOWS[mine]}",
        )
