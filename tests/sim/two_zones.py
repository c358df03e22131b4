"""The example's arms with two zones between them, which each passes in another order."""

from pathlib import Path

from tests.unit.config_world import Copy

PAUSE = "WAIT 2\n"
_ZONES = """  north:
    size: [900, 1100, 2600]
    pose: {X: 0, Y: 550, Z: 1400, A: 0, B: 0, C: 0}
    robots: [left, right]
  south:
    size: [900, 1100, 2600]
    pose: {X: 0, Y: -550, Z: 1400, A: 0, B: 0, C: 0}
"""
_ONE_ZONE = """  handover:
    size: [900, 2600, 2600]
    pose: {X: 0, Y: 0, Z: 1400, A: 0, B: 0, C: 0}
"""
_IN = "MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0 F=80\nML X=1450 Y=500 Z=1350 A=0 B=90 C=0 F={feed}\n"
_ACROSS = "ML Y=-500 F=400\nML X=980 Y=0 F=900\nHOME F=80\nEND\n"
"""The right arm is turned by half a turn: what is north for one is south for the other."""


def two_zones(folder: Path, left: str, right: str, *, ordered: bool = False, feed: int = 300) -> Path:
    """A copy of the example, on slow buses; `left` and `right` is what they do on the way from zone to zone.

    `ordered`: robots are kept apart, too, so the manager knows who must get through before whom. `feed` [mm/s] into the
    first zone: a fast robot asks for it before all of its way out is planned.
    """
    copy = Copy(folder)
    copy.change("two_arms/cell.yaml", _ONE_ZONE, _ZONES)
    if not ordered:
        copy.cell.write_text(f"{copy.cell.read_text()}separation: off\n")
    copy.slow_buses()
    for robot, between in (("left", left), ("right", right)):
        (copy.folder / f"two_arms/programs/{robot}.prog").write_text(_IN.format(feed=feed) + between + _ACROSS)
    return copy.cell
