"""How fast a recording is played and from where, chosen in the browser: alike for all who watch it."""

from typing import Any

import viser

from cell.view.source import Player

SPEEDS = {"stands": 0.0, "1/4": 0.25, "1": 1.0, "2": 2.0, "5": 5.0, "20": 20.0}
_STEP_S = 0.1


class Playback:
    """The two widgets. What is chosen there counts at the next `look`: a recording is read by one thread."""

    def __init__(self, gui: viser.GuiApi, player: Player, speed: float) -> None:
        self._player = player
        self._lasts_s = max(player.ends - player.began, _STEP_S)
        self._chosen: dict[str, float] = {}
        speeds = SPEEDS if speed in SPEEDS.values() else SPEEDS | {f"{speed:g}": speed}
        now = next(name for name, value in speeds.items() if value == speed)
        self._speed: Any = gui.add_dropdown("times as fast", tuple(speeds), initial_value=now)
        self._place: Any = gui.add_slider("seconds", min=0.0, max=self._lasts_s, step=_STEP_S, initial_value=0.0)
        self._shown = 0.0

        @self._speed.on_update
        def _(_: object) -> None:
            self._chosen["speed"] = speeds[self._speed.value]

        @self._place.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                self._chosen["place"] = float(self._place.value)

    def look(self) -> None:
        """Do what was chosen, and show where the recording is."""
        if (speed := self._chosen.pop("speed", None)) is not None:
            self._player.pace(speed)
        if (place := self._chosen.pop("place", None)) is not None:
            self._player.seek(self._player.began + place)
        at = round(min(max(self._player.now() - self._player.began, 0.0), self._lasts_s), 1)
        if at != self._shown and not self._chosen:
            self._shown = self._place.value = at
