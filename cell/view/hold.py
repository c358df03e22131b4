"""The dead man of a button in a browser: whether it is held now, by what was heard since a moment that is known.

While a button is held the browser repeats a sign. That proves only that it was held when the sign was sent: a network,
a slow browser or one that was frozen may deliver it when the hand has long gone. So the page sends pings: what comes
after the answer to a ping is younger than the ping (the echo of `docs/architecture.md`, section 4.2). The browser says,
too, when the button is let go. A press that ends without that word is over: its signs do nothing, whenever they come.
"""

import math
from dataclasses import dataclass
from enum import Enum, auto

SILENT_S = 0.2
"""A press is over when no sign came that counts for so long."""
LATE_S = 0.2
"""A sign that may be older than this does not count."""


class Press(Enum):
    """Where a press of the button is."""

    NONE = auto()
    ASKED = auto()
    """Signs come; none of them is known to be young yet."""
    HELD = auto()
    OVER = auto()
    """It fell silent, or its signs came late: the button has to be let go first."""


@dataclass(slots=True)
class Hold:
    """One button of one browser, on one clock [s]."""

    press: Press = Press.NONE
    _asked_at: float = math.inf
    """When the first sign of this press came: only a ping that was sent later proves something."""
    _younger_than: float = -math.inf
    """When the newest ping was sent that was answered."""
    _sign_at: float = -math.inf
    """When the newest sign came; of a press that is held, the newest that counts."""

    def sign(self, now: float) -> bool:
        """The browser says that the button is held; whether that counts."""
        self.look(now)
        if self.press is Press.NONE:
            self.press, self._asked_at, self._sign_at = Press.ASKED, now, now
        if self.press is Press.OVER:
            return False
        young = self._asked_at <= self._younger_than and now - self._younger_than <= LATE_S
        if young:
            self.press = Press.HELD
        if young or self.press is Press.ASKED:
            self._sign_at = now
        return young

    def answered(self, sent_at: float) -> None:
        """The browser has answered a ping of `sent_at`, and every sign that came before the answer was told here."""
        self._younger_than = max(self._younger_than, sent_at)

    def let_go(self) -> None:
        """The browser says that the button was let go; what comes later is of another press."""
        self.press = Press.NONE

    def look(self, now: float) -> Press:
        """Where the press is now."""
        if self.press in (Press.ASKED, Press.HELD) and now - self._sign_at > SILENT_S:
            self.press = Press.OVER
        return self.press
