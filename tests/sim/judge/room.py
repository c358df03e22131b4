"""Robots that share room without zones: who may be where, by the drives themselves and by what the manager keeps."""

import numpy as np

from cell.geometry import capsule_distance
from cell.messages import Event, Presence, SetpointBlock
from tests.sim.judge.facts import Facts, Floats, Sample
from tests.sim.judge.invariant import Handlers, Invariant

_TOLERANCE_M = 0.002
_WITHIN_M = 0.001


class KeptApart(Invariant):
    """Two real bodies keep their margin, but where a robot was brought beside its path by a drive that fails, or both
    were nearer from the beginning; then they do not approach each other by themselves."""

    name = "robots are kept apart"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._newest: dict[str, Sample] = {}
        self._forced: set[str] = set()
        """Robots that were beside their paths at some time, until they are far enough from all others again."""

    @property
    def published(self) -> Handlers:
        return {Event: self._told}

    def _told(self, _name: str, event: Event) -> None:
        if event.code == "space_forced":
            self._forced.add(event.text.split()[0])

    def look(self, sample: Sample) -> None:
        separation = self.facts.cell.separation
        if separation is None:
            return
        if self.facts.hindered(sample.robot, sample.at):
            self._forced.add(sample.robot)
        self._newest[sample.robot] = sample
        near = False
        for other, its in self._newest.items():
            if other == sample.robot:
                continue
            away, margin = self._away(sample, its), separation.margin_of(sample.robot, other)
            near |= away < margin
            if away < margin - _TOLERANCE_M and self._forced.isdisjoint((sample.robot, other)):
                what = f"they are {1000 * away:.1f} mm apart, {1000 * margin:g} mm are kept"
                self.broken(f"{sample.robot} and {other}", what, sample.at)
        if not near:
            self._forced.discard(sample.robot)

    def _away(self, one: Sample, other: Sample) -> float:
        """Between what moves of either and all of the other [m]."""
        (first, first_radii, first_moves), (second, second_radii, second_moves) = map(self._body, (one, other))
        away = capsule_distance(first[:, None], first_radii[:, None], second[None], second_radii[None])
        return float(away[first_moves[:, None] | second_moves[None]].min())

    def _body(self, sample: Sample) -> tuple[Floats, Floats, np.ndarray]:
        model = self.facts.world.models[sample.robot]
        return sample.points, model.capsule_radii, np.array([each.link != 0 for each in model.body])


class BlockIsOwned(Invariant):
    """Every block leads only through sections that the presence before it says are owned."""

    name = "blocks keep to owned space"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._presence: dict[str, Presence] = {}

    @property
    def published(self) -> Handlers:
        if self.facts.cell.separation is None:
            return {}
        return {Presence: self._said, SetpointBlock: self._sent}

    def _said(self, name: str, presence: Presence) -> None:
        self._presence[name] = presence

    def _sent(self, name: str, block: SetpointBlock) -> None:
        presence = self._presence.get(name)
        moving = np.ptp(block.position, axis=0).max(initial=0.0) > 0.0
        if presence is None or not presence.body.known or not moving:
            return
        way = presence.way
        owned = way.sections[: way.committed]
        points = self.facts.points(block.robot, block.position)
        radii = self.facts.world.models[block.robot].capsule_radii
        c = points.shape[1]
        away = np.linalg.norm(points[:, None] - owned.points[None, :, :c], axis=-1).max(axis=-1)
        outside = (away + radii - owned.radii[None, :, :c]).max(axis=-1).min(axis=1).max()
        if outside > _WITHIN_M:
            what = f"block {block.sequence} leads {1000 * outside:.1f} mm out of what its robot has committed"
            self.broken(block.robot, what)
