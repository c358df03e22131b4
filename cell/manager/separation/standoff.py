"""Robots that keep each other out of the room that each needs next: none of them ever goes on by itself."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from cell.manager.circles import LastingCircles
from cell.messages import Deadlock, Refusal


@dataclass(slots=True)
class StandoffWatch:
    """Looks for circles of robots at rest that wait for each other."""

    way_back: Callable[[str, tuple[str, ...]], bool]
    """Whether all these robots get through once the first one is let back."""
    _circles: LastingCircles[tuple[str, ...]] = field(default_factory=LastingCircles)

    @property
    def present(self) -> tuple[Deadlock, ...]:
        """Those that were told and still last."""
        return self._circles.present

    def look(self, refused: Mapping[str, Refusal], now: float) -> list[Deadlock]:
        """The stand-offs that are new. `refused`: who rests and is cleared nothing, and why; `now` is cell time [s]."""
        return self._circles.look(
            _circles_of(refused),
            now,
            lambda robots: Deadlock(robots, (), now, _text(robots, refused), self._remedy(robots)),
        )

    def _remedy(self, robots: tuple[str, ...]) -> str:
        back = next((robot for robot in robots if self.way_back(robot, robots)), None)
        if back is None:
            return (
                "no way back frees them: halt one of them (`cell halt ROBOT`), jog it away with `cell jog ROBOT`, "
                "and when the others have passed `cell return ROBOT` and `cell continue ROBOT`"
            )
        others = " and ".join(robot for robot in robots if robot != back)
        return (
            f"let {back} back: `cell override {back} -50` until {others} got through, then `cell override {back} 100`; "
            f"where what is kept of its path does not suffice, `cell halt {back}`, then jog it away "
            f"(`cell jog {back} --help`), and when {others} got through `cell return {back}` and `cell continue {back}`"
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
