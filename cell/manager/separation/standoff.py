"""Robots that keep each other out of the room that each needs next: none of them ever goes on by itself."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from cell.manager.circles import LastingCircles
from cell.messages import Deadlock, Refusal


@dataclass(slots=True)
class StandoffWatch:
    """Looks for circles of robots at rest that wait for each other."""

    way_back_m: Callable[[str, tuple[str, ...]], float | None]
    """How far a robot must be let back so that all of these get through [m]; None: no way back frees them."""
    tcp_m: Callable[[str], tuple[float, float, float] | None]
    """Where the TCP of a robot was heard last; None: that was not known."""
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
            lambda robots: Deadlock(robots, (), now, self._text(robots, refused), self._remedy(robots)),
        )

    def _remedy(self, robots: tuple[str, ...]) -> str:
        backs = ((robot, self.way_back_m(robot, robots)) for robot in robots)
        back, by_m = next(((robot, by_m) for robot, by_m in backs if by_m is not None), ("", 0.0))
        if not back:
            return (
                "no way back frees them: halt one of them (`cell halt ROBOT`), jog it away with `cell jog ROBOT`, "
                "and when the others have passed `cell return ROBOT` and `cell continue ROBOT`"
            )
        others = " and ".join(robot for robot in robots if robot != back)
        return (
            f"let {back} back, by some {_rounded_mm(by_m)} mm: `cell override {back} -50` until {others} got through, "
            f"then `cell override {back} 100`; "
            f"where what is kept of its path does not suffice, `cell halt {back}`, then jog it away "
            f"(`cell jog {back} --help`), and when {others} got through `cell return {back}` and `cell continue {back}`"
        )

    def _text(self, robots: tuple[str, ...], refused: Mapping[str, Refusal]) -> str:
        places = ((robot, self.tcp_m(robot)) for robot in robots)
        told = (
            f"the TCP of {robot} is at X {1e3 * at[0]:.0f}, Y {1e3 * at[1]:.0f}, Z {1e3 * at[2]:.0f} mm"
            for robot, at in places
            if at is not None
        )
        parts = "; ".join([*(refused[robot].text for robot in robots), *told])
        return f"{' and '.join(robots)} wait for each other: {parts}"


def _rounded_mm(by_m: float) -> int:
    """Planned ways are known in coarse pieces only."""
    return 10 * math.ceil(100.0 * by_m)


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
