"""What all robots of a family have in common: their joints and their links."""

from dataclasses import dataclass

from robot_agent.model.description import Family


@dataclass(frozen=True, slots=True)
class FamilyShape:
    """Joints J1, J2, ... from the base on, and links from the base to the flange."""

    linear: tuple[bool, ...]
    """Per joint: whether it slides."""
    links: tuple[str, ...]
    lengths: tuple[str, ...]
    """Names of the lengths in `geometry`."""
    fewest: int
    """A robot of the family may lack the joints behind this one."""

    def joint_names(self, count: int | None = None) -> tuple[str, ...]:
        return tuple(f"J{i + 1}" for i in range(len(self.linear) if count is None else count))


def _shape(linear: str, links: str, lengths: str, fewest: int | None = None) -> FamilyShape:
    """`linear`: one letter per joint, R turns and P slides."""
    return FamilyShape(
        tuple(letter == "P" for letter in linear), tuple(links.split()), tuple(lengths.split()), fewest or len(linear)
    )


SHAPES = {
    Family.SIX_AXIS: _shape("RRRRRR", "base 1 2 3 4 5 flange", "a1z a2x a2z a3z a4x a4z a5x a6x"),
    Family.COBOT: _shape("RRRRRR", "base 1 2 3 4 5 flange", "a1y a1z a2x a2y a3x a3y a4z a5y"),
    Family.SCARA: _shape("RRPR", "base 1 2 3 flange", "a1x a1z a2x a2z a4z"),
    Family.PALLETIZER: _shape("RRRR", "base 1 2 3 hand flange", "a1x a1z a2z a3x a4x a4z"),
    Family.DELTA: _shape("RRRR", "base arm1 arm2 arm3 rod1 rod2 rod3 flange", "r h k s t", fewest=3),
    Family.GANTRY: _shape("PPPRRR", "base 1 2 3 4 5 flange", "a6z"),
}
"""Shapes of the families with a closed form; the shape of a URDF robot is in its URDF."""
