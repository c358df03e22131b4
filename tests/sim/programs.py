"""Programs for generated cells: in and out of zones, with all that a program may do there."""

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Way:
    """How a robot comes to a zone: in which direction [deg] of its base, and how far aside [mm]."""

    zone: str
    angle: float
    aside: float


@dataclass(frozen=True, slots=True)
class Approach:
    """How a family comes to its zones, and its drives. Lengths [mm] and angles [deg] as in a program."""

    axes: dict[str, str]
    near_mm: float
    """From the base to the face of the zone: outwards, or downwards where the zone is entered from above."""
    out_mm: float
    in_mm: tuple[float, float]
    """Where the flange is outside, and how far inside."""
    levels_mm: tuple[float, float]
    """Lowest and highest Z of moves inside; where a zone is entered from above, half the width of moves inside."""
    base_z_mm: float = 0.0
    top: bool = False
    middle_mm: tuple[float, float] = (0.0, 0.0)
    """Under which place of the base the middle of a zone is that is entered from above."""


def _axis(node: str, gear: float, speed: float, acceleration: float, quick: float, window: float) -> str:
    return (
        f"node: {node}, gear: {gear}, counts_per_turn: 131072, direction: 1, offset: 0, speed: {speed}, "
        f"acceleration: {acceleration}, quick_stop: {quick}, following_window: {window}"
    )


def _slide(node: str, feed: float, gear: float, speed: float, acceleration: float, quick: float) -> str:
    return f"type: linear, feed: {feed}, " + _axis(node, gear, speed, acceleration, quick, 40)


APPROACHES = {
    "six_axis": Approach(
        {
            "J1": _axis("1", 180, 121, 462, 600, 4),
            "J2": _axis("2", 200, 110, 413, 550, 4),
            "J3": _axis("3", 190, 116, 495, 650, 4),
            "J4": _axis("4", 120, 198, 825, 1100, 6),
            "J5": _axis("5", 120, 198, 825, 1100, 6),
            "J6": _axis("6", 80, 264, 990, 1300, 8),
        },
        near_mm=1350.0,
        out_mm=980.0,
        in_mm=(1450.0, 1650.0),
        levels_mm=(1150.0, 1450.0),
    ),
    "palletizer": Approach(
        {
            "J1": _axis("1", 150, 143, 495, 650, 4),
            "J2": _axis("1, axis: 2", 150, 121, 413, 550, 4),
            "J3": _axis("1, axis: 3", 90, 253, 908, 1200, 8),
            "J4": _axis("4", 50, 330, 1485, 2000, 10),
        },
        near_mm=1450.0,
        out_mm=1150.0,
        in_mm=(1450.0, 1600.0),
        levels_mm=(1150.0, 1400.0),
    ),
    "scara": Approach(
        {
            "J1": _axis("1", 50, 440, 3300, 4500, 12),
            "J2": _axis("2", 50, 550, 4950, 6500, 15),
            "J3": _slide("3", 20, 1, 990, 13200, 17000),
            "J4": _axis("4", 15, 1320, 13200, 17000, 40),
        },
        near_mm=330.0,
        out_mm=190.0,
        in_mm=(400.0, 480.0),
        levels_mm=(-80.0, 30.0),
        base_z_mm=950.0,
    ),
    "gantry": Approach(
        {
            "J1": _slide("1", 100, 5, 660, 3300, 5000),
            "J2": _slide("2", 100, 5, 660, 3300, 5000),
            "J3": _slide("3", 60, 3, 440, 2500, 4000),
            "J4": _axis("4", 3, 200, 1160, 1800, 8),
            "J5": _axis("5", 1, 200, 1160, 1800, 8),
            "J6": _axis("6", 1, 400, 2500, 4000, 16),
        },
        near_mm=380.0,
        out_mm=500.0,
        in_mm=(230.0, 330.0),
        levels_mm=(60.0, 180.0),
        top=True,
        middle_mm=(590.0, -590.0),
    ),
    "delta": Approach(
        {
            "J1": _axis("1", 30, 660, 13200, 17000, 25),
            "J2": _axis("2", 30, 660, 13200, 17000, 25),
            "J3": _axis("3", 30, 660, 13200, 17000, 25),
            "J4": _axis("4", 8, 1320, 16500, 20000, 40),
        },
        near_mm=-660.0,
        out_mm=-540.0,
        in_mm=(-700.0, -650.0),
        levels_mm=(40.0, 120.0),
        top=True,
    ),
}


def program_text(rng: random.Random, family: str, ways: Sequence[Way]) -> str:
    """A program that visits the zones again and again; it ends at home."""
    lines = ["; drawn"]
    lines.append(rng.choice(["RESET DO gripper", "SET DO gripper", "SET DO gripper", "SET DO gripper"]))
    lines.append("LABEL again")
    visits = [rng.choice(list(ways)) for _ in range(rng.choice([1, 1, 2]))]
    if len(ways) > 1:
        visits = list(ways) if rng.random() < 0.6 else list(reversed(ways))
    for way in visits:
        lines += _Visit(rng, family, way).lines()
    if rng.random() < 0.3:
        lines.append(f"WAIT {rng.choice([0.1, 0.2, 0.5])}")
    if len(visits) == 1 or rng.random() < 0.3:
        lines.append(f"GOTO again {rng.choice([1, 1, 2])}")
    lines += ["HOME F=80", "END"]
    return "\n".join(lines) + "\n"


class _Visit:
    """One way in and out of a zone."""

    def __init__(self, rng: random.Random, family: str, way: Way) -> None:
        self._rng = rng
        self._family = family
        self._way = way
        self._approach = APPROACHES[family]
        fastest = {"delta": 2000.0, "gantry": 600.0}.get(family, 1500.0)
        self._feed = rng.choice([fastest, fastest, 0.6 * fastest, 0.3 * fastest])
        self._round = rng.random() < 0.35
        self._even = rng.random() < 0.5
        """Round coordinates and exact symmetry."""

    def lines(self) -> list[str]:
        rng = self._rng
        made = self._in_front()
        if rng.random() < 0.25:
            made.append(f"WAIT {rng.choice([0.1, 0.3, 1.0])}")
        made += self._visit_from_above() if self._approach.top else self._visit()
        if rng.random() < 0.4:
            made.append(rng.choice(["SET DO gripper", "RESET DO gripper"]))
        return made

    def _in_front(self) -> list[str]:
        """The robot in front of the zone, its place known."""
        speed = self._rng.choice([60, 80, 100])
        angle, family = self._way.angle, self._family
        if family == "six_axis":
            return [f"MJ J1={angle:g} J2=-12 J3=65 J4=0 J5=37 J6=0 F={speed}", self._line(self._approach.out_mm)]
        if family == "palletizer":
            return [f"MJ J1={angle:g} J2=-20 J3=20 J4=0 F={speed}", self._line(self._approach.out_mm, z=1400.0)]
        if family == "scara":
            elbow = -70.0 if angle >= 0.0 else 70.0
            return [f"MJ J1={angle + elbow:g} J2={-2 * elbow:g} J3=20 J4={elbow:g} F={speed}"]
        if family == "gantry":
            return [f"MJ J1=590 J2=590 J3=620 J4=0 J5=30 J6=0 F={speed}", f"ML Z={self._approach.out_mm:g} F=400"]
        return [f"MJ J1=10 J2=10 J3=10 J4=0 F={speed}"]

    def _visit(self) -> list[str]:
        rng, approach = self._rng, self._approach
        low, high = approach.levels_mm
        level = self._number(low, high)
        deep = self._number(*approach.in_mm)
        made = []
        if rng.random() < 0.3:
            # Slowly along the border first: the published body is near it for long.
            made.append(
                self._line(approach.near_mm - rng.choice([0.0, 30.0, 100.0]) - _AHEAD_MM[self._family], feed=80.0)
            )
        made.append(self._line(deep, z=level if rng.random() < 0.5 else None))
        made += self._inside(lambda: f"ML Z={self._number(low, high):g} F={0.4 * self._feed:g}{self._corner()}")
        if rng.random() < 0.4:
            made.append(self._line(self._number(*approach.in_mm), aside=rng.choice([-60.0, 60.0])))
        made.append(self._line(approach.out_mm, last=True))
        return made

    def _visit_from_above(self) -> list[str]:
        rng, approach = self._rng, self._approach
        deep = self._number(*approach.in_mm)
        made = [f"ML Z={deep:g} F={self._feed:g}{self._corner()}"]
        x, y = approach.middle_mm
        half = self._number(*approach.levels_mm)
        made += self._inside(lambda: f"ML X={x + rng.choice([-half, half, 0.0]):g} F={self._feed:g}{self._corner()}")
        if rng.random() < 0.4:
            made.append(f"ML Y={y + rng.choice([-half, half]):g} F={self._feed:g}{self._corner()}")
        if rng.random() < 0.4:
            # The arch of pick and place: up, across, down.
            made += [
                f"ML Z={approach.out_mm:g}{self._corner()} F=9999",
                f"ML X={x:g} Y={y:g}{self._corner()} F=9999",
                f"ML Z={deep:g} F=9999",
            ]
        made.append(f"ML Z={approach.out_mm:g} F={self._feed:g}")
        return made

    def _inside(self, move: object) -> list[str]:
        rng, made = self._rng, []
        for _ in range(rng.choice([0, 1, 1, 2])):
            made.append(move())  # type: ignore[operator]
            if rng.random() < 0.3:
                made.append(f"WAIT {rng.choice([0.05, 0.2, 0.5])}")
            if rng.random() < 0.3:
                made.append(rng.choice(["SET DO gripper", "RESET DO gripper"]))
        return made

    def _line(
        self, out: float, z: float | None = None, aside: float = 0.0, feed: float | None = None, last: bool = False
    ) -> str:
        angle, side = math.radians(self._way.angle), self._way.aside + aside
        x = math.cos(angle) * out - math.sin(angle) * side
        y = math.sin(angle) * out + math.cos(angle) * side
        level = "" if z is None else f" Z={z:g}"
        return f"ML X={x:.6g} Y={y:.6g}{level} F={feed or self._feed:g}{'' if last else self._corner()}"

    def _corner(self) -> str:
        return f" R={self._rng.choice([20, 50])}" if self._round else ""

    def _number(self, low: float, high: float) -> float:
        number = self._rng.uniform(low, high)
        return 50.0 * round(number / 50.0) if self._even else round(number, 1)


_AHEAD_MM = {"six_axis": 210.0, "palletizer": 250.0, "scara": 40.0}
"""How far the body is ahead of the flange."""
