"""Robots that keep each other out of the room that each needs next: none of them ever goes on by itself.

Nobody backs by itself: what a program has switched on its way can not be undone by going back. So people are told.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from cell.messages import Deadlock, Refusal

LASTING_S = 1.0
"""What lasts so long is no passing moment; what was not seen for so long is over."""


@dataclass(slots=True)
class _Circle:
    seen_first: float
    seen_last: float
    deadlock: Deadlock | None = None
    """Once it was told."""


@dataclass(slots=True)
class StandoffWatch:
    """Looks for circles of robots at rest that wait for each other, and remembers since when each is there."""

    way_back: Callable[[str, tuple[str, ...]], bool]
    """Whether all these robots get through once the first one is let back."""
    _circles: dict[tuple[str, ...], _Circle] = field(default_factory=dict)

    @property
    def present(self) -> tuple[Deadlock, ...]:
        """Those that were told and still last."""
        return tuple(each.deadlock for each in self._circles.values() if each.deadlock is not None)

    def look(self, refused: Mapping[str, Refusal], now: float) -> list[Deadlock]:
        """The stand-offs that are new. `refused`: who rests and is cleared nothing, and why; `now` is cell time [s]."""
        for circle in _circles_of(refused):
            self._circles.setdefault(circle, _Circle(now, now)).seen_last = now
        self._circles = {robots: each for robots, each in self._circles.items() if now - each.seen_last <= LASTING_S}
        found = []
        for robots, each in self._circles.items():
            if each.deadlock is None and each.seen_last == now and now - each.seen_first >= LASTING_S:
                each.deadlock = Deadlock(robots, (), now, _text(robots, refused), self._remedy(robots))
                found.append(each.deadlock)
        return found

    def _remedy(self, robots: tuple[str, ...]) -> str:
        back = next((robot for robot in robots if self.way_back(robot, robots)), None)
        if back is None:
            return (
                "no way back frees them: halt one of them (`cell halt ROBOT`), jog it away with `cell jog ROBOT`, "
                "and let it `cell return` when the others have passed"
            )
        others = " and ".join(robot for robot in robots if robot != back)
        return (
            f"let {back} back: `cell override {back} -50` until {others} can go on, "
            f"then `cell halt {back}`; when {others} has passed: `cell override {back} 100`, `cell continue {back}`"
        )


def _text(robots: tuple[str, ...], refused: Mapping[str, Refusal]) -> str:
    return f"{' and '.join(robots)} wait for each other: {'; '.join(refused[robot].text for robot in robots)}"


def _circles_of(refused: Mapping[str, Refusal]) -> list[tuple[str, ...]]:
    """Each circle once, from its first robot by name on, in the order in which they wait."""
    found = []
    for start in sorted(refused):
        way = [start]
        while (following := refused[way[-1]].by) in refused and following not in way:
            way.append(following)
        if following == start and len(way) > 1 and start == min(way):
            found.append(tuple(way))
    return found
