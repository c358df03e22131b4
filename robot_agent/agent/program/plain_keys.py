"""Inputs of the cell: Zenoh keys on which an application puts `true` or `false`, again and again.

Such a text says nothing of its age, so its arrival counts, and after a freeze of this process nothing that came before.
"""

from collections.abc import Collection
from dataclasses import dataclass

from cell.core import Effect
from cell.net.plain import PlainText
from robot_agent.language import Signal

_SAID = {"true": True, "false": False}
_SHOWN = 20
"""Characters of another text."""


@dataclass(frozen=True, slots=True)
class HearKeys(Effect):
    """From here on also what is put on these keys is heard: `PlainText`."""

    keys: tuple[str, ...]


class PlainKeys:
    """The keys that the programs of this robot have asked for."""

    def __init__(self) -> None:
        self._heard: dict[str, PlainText] = {}
        self._asked: set[str] = set()

    def need(self, keys: Collection[str]) -> HearKeys | None:
        """A program asks for these; what is to be heard besides what is heard already."""
        new = sorted(set(keys) - self._asked)
        self._asked.update(new)
        return HearKeys(tuple(new)) if new else None

    def heard(self, text: PlainText) -> None:
        """Somebody has put something on a key."""
        self._heard[text.key] = text

    def forget(self) -> None:
        """The process stood still: what waits for it may be old."""
        self._heard.clear()

    def on(self, signal: Signal, now: float, oldest_s: float) -> bool | None:
        """Whether the key says `true`, by what arrived less than `oldest_s` ago; None where nobody knows."""
        return None if self.why_unknown(signal, now, oldest_s) else _SAID[self._said(signal)]

    def why_unknown(self, signal: Signal, now: float, oldest_s: float) -> str:
        """Why nobody knows it, for people; empty when it is known."""
        heard = self._heard.get(signal.name)
        if heard is None:
            return f"nothing is heard on {signal}"
        if now - heard.at >= min(oldest_s, signal.fresh_s):
            return f"nothing young is heard on {signal}: the newest is {now - heard.at:.1f} s old"
        said = self._said(signal)
        return "" if said in _SAID else f"{signal} says `{said[:_SHOWN]}`, allowed are true and false"

    def _said(self, signal: Signal) -> str:
        return self._heard[signal.name].text.strip()
