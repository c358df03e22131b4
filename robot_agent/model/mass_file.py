"""Schema of what a robot file says about the masses of its links."""

from typing import Annotated

import numpy as np
from pydantic import BaseModel, Field

from cell.config.units import STRICT, Length, Number, Positive
from robot_agent.model.description import LinkMass

Inertia = tuple[Number, Number, Number, Number, Number, Number]
"""xx, yy, zz, xy, xz, yz."""


def inertia_matrix(entry: Inertia) -> np.ndarray:
    """`(3, 3)` [kg m^2]; the entries are elements of the matrix, products of inertia with their sign."""
    xx, yy, zz, xy, xz, yz = entry
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


class MassEntry(BaseModel):
    """What one link weighs, motors that it carries included."""

    model_config = STRICT
    link: int = Field(ge=1, description="1 is the link behind J1, ... the last one the flange; the base never moves")
    mass_kg: Positive = Field(description="mass [kg]")
    centre: tuple[Length, Length, Length] = Field(description="centre of mass in the link's frame: [x, y, z]")
    inertia_kg_m2: Inertia = Field(
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        description="about the centre of mass, along the link's axes: [xx, yy, zz, xy, xz, yz] in kg m^2",
    )
    source: Annotated[str, Field(min_length=1)] = Field(description="where its numbers are from, for people")

    def mass(self) -> LinkMass:
        return LinkMass(self.link, self.mass_kg, self.centre, inertia_matrix(self.inertia_kg_m2), self.source)
