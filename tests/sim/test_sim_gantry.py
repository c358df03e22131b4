"""The gantry of `cell_configs/festo_gantry`, frame by frame: PDO map, homing, motions by its drives' own profiles."""

from pathlib import Path

import numpy as np
import pytest

from cell.messages import Home, MoveAxes, SetpointBlock
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.pdo_map import NO_REMOTE
from drive_gateway.canopen.sdo import Sdo
from drive_gateway.config import load_drives
from drive_gateway.sim.config.load import load_simulation
from tests.sim.gateway_bench import GatewayBench

FILE = Path(__file__).parents[2] / "cell_configs" / "festo_gantry" / "drives.yaml"
CYCLE_S = 0.01
# Thesis, section on PDOs: mapping of all six controllers; identifiers of node 1.
RPDOS = {0: [0x60400010], 1: [0x607A0020, 0x60820020], 2: [0x60FF0020]}
TPDOS = {0: [0x60410010, 0x60640020], 1: [0x606C0020, 0x20740020]}
LIMIT_SWITCHES = [0x60FD0020]
"""Of the slides."""
HOME_M = {"J1": -0.005, "J2": -0.005, "J3": 0.805}


class Gantry(GatewayBench):
    """Brought up; `heard` is every frame on the bus with its time, in both directions."""

    def __init__(self) -> None:
        super().__init__(load_drives(FILE, "gantry_bus"), load_simulation(FILE))
        self.axes = self.settings.robots["gantry"].axes
        self.heard: list[tuple[float, CanFrame]] = []
        self.lost = self._listen
        self.ready()

    def _listen(self, frame: CanFrame) -> bool:
        self.heard.append((self.now, frame))
        return False

    def places(self) -> np.ndarray:
        """Where the axes really are [m or rad], whatever their drives believe."""
        return np.array([self.bus.nodes[a.node_id].position / a.counts_per_unit + a.offset for a in self.axes])

    def read(self, node_id: int, index: int, sub: int) -> int:
        return int.from_bytes(self.bus.sdo(Sdo("", node_id, index, sub, None), self.now).data, "little")

    def since(self, started: float, cob_id: int) -> list[tuple[float, bytes]]:
        return [(at, frame.data) for at, frame in self.heard if at >= started and frame.id == cob_id]


@pytest.fixture(scope="module")
def homed() -> Gantry:
    gantry = Gantry()
    assert not gantry.feedback.referenced
    assert gantry.set_up(Home("gantry", ())) == "done"
    return gantry


def test_a_slide_that_is_not_referenced_ends_at_its_limit_switch() -> None:
    gantry = Gantry()
    assert gantry.set_up(MoveAxes("gantry", {"J1": -0.5}, True, 1.0, False)) == "stopped"
    assert gantry.said[0] == "stopped: node 1 (gantry J1) is at its negative limit switch (60FDh bit 0)"
    assert -0.01 < gantry.places()[0] <= -0.005
    assert "J1=DISTANCE --by" in gantry.ask(MoveAxes("gantry", {"J1": -0.01}, True, 1.0, False)).text
    assert gantry.set_up(MoveAxes("gantry", {"J1": 0.1}, True, 1.0, False)) == "done"


def test_it_homes_the_z_slide_first_then_the_others_and_then_knows_where_it_is(homed: Gantry) -> None:
    begun = [next(at for at, data in homed.since(0.0, 0x200 + node) if data == b"\x1f\0") for node in range(1, 7)]
    assert begun[2] < begun[0] == begun[1] < begun[3] == begun[4] == begun[5]
    assert homed.feedback.referenced
    assert homed.feedback.position == pytest.approx(homed.places(), abs=2e-4)


@pytest.mark.parametrize("node", range(1, 7))
def test_every_node_shows_the_pdo_map_of_the_thesis_and_the_cyclic_image_as_its_fourth(
    homed: Gantry, node: int
) -> None:
    rpdos, tpdos = {**RPDOS, 3: [0x60400010, 0x607A0020]}, {**TPDOS, 3: [0x60410010, 0x60640020]}
    for number, entries in rpdos.items():
        assert homed.read(node, 0x1400 + number, 1) == 0x200 + 0x100 * number + node
        assert homed.read(node, 0x1400 + number, 2) == (1 if number == 3 else 0xFE)
        assert [homed.read(node, 0x1600 + number, 1 + sub) for sub in range(len(entries))] == entries
        assert homed.read(node, 0x1600 + number, 0) == len(entries)
    tpdos |= {2: LIMIT_SWITCHES} if node <= 3 else {}
    for number, entries in tpdos.items():
        assert homed.read(node, 0x1800 + number, 1) & ~NO_REMOTE == 0x180 + 0x100 * number + node
        assert [homed.read(node, 0x1A00 + number, 1 + sub) for sub in range(len(entries))] == entries
        assert homed.read(node, 0x1A00 + number, 0) == len(entries)
    assert [homed.read(node, 0x1800, sub) for sub in (2, 3, 5)] == [0xFE, 400, 40]
    assert homed.read(node, 0x1803, 2) == 1


def test_the_tpdos_of_the_thesis_come_every_40_ms_at_rest_and_in_motion(homed: Gantry) -> None:
    started = homed.now
    homed.set_up(MoveAxes("gantry", {"J2": 0.02}, True, 1.0, False))
    homed.run(0.4)
    for cob_id, size in ((0x182, 6), (0x282, 8)):
        sent = homed.since(started, cob_id)
        assert {len(data) for _, data in sent} == {size}
        assert np.diff([at for at, _ in sent]) == pytest.approx(0.04, abs=1e-6)


def together(distances: list[float], speeds: np.ndarray, ramps: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """The thesis' synchronised trapezoid: duration, speed and stop time of each axis."""
    d = np.abs(distances)
    reached = d >= speeds**2 / ramps
    single = np.where(reached, d / speeds + speeds / ramps, 2 * np.sqrt(d / ramps))
    total = float(single.max())
    v = ramps / 2 * (total - np.sqrt(np.maximum(total**2 - 4 * d / ramps, 0.0)))
    return total, v, total - v / ramps


def quarter(gantry: Gantry) -> tuple[np.ndarray, np.ndarray]:
    """Speed and acceleration that set-up may use."""
    return (
        0.25 * np.array([axis.speed for axis in gantry.axes]),
        0.25 * np.array([axis.acceleration for axis in gantry.axes]),
    )


WAYS = [0.3, 0.2, -0.1, 0.9, 0.6, -0.45]
NAMES = ["J1", "J2", "J3", "J4", "J5", "J6"]


def travel(gantry: Gantry, ways: list[float], by_velocity: bool) -> tuple[float, np.ndarray, np.ndarray]:
    """Move by `ways`; answers when it began, the times `(m,)` and the velocities `(m, 6)` of the axes."""
    assert gantry.ask(MoveAxes("gantry", dict(zip(NAMES, ways, strict=True)), True, 1.0, by_velocity)).ok
    gantry.holder, gantry.said = "gantry", ("", "moving")
    began, times, velocities = gantry.now, [], []
    while gantry.said[1] == "moving":
        gantry.cycle()
        times.append(gantry.now)
        velocities.append(gantry.feedback.velocity)
    gantry.holder = ""
    gantry.run(0.3)
    return began, np.array(times), np.array(velocities)


@pytest.mark.parametrize("by_velocity", [False, True], ids=["profile position", "profile velocity"])
def test_all_six_axes_start_and_end_together_at_the_speeds_of_the_synchronised_trapezoid(
    homed: Gantry, by_velocity: bool
) -> None:
    total, speeds, _ = together(WAYS, *quarter(homed))
    before = homed.places()
    _, times, velocities = travel(homed, WAYS, by_velocity)
    count_per_cycle = np.array([1.0 / (abs(axis.counts_per_unit) * CYCLE_S) for axis in homed.axes])
    assert np.all(np.abs(np.abs(velocities).max(axis=0) - speeds) < 0.02 * speeds + count_per_cycle)
    moving = np.abs(velocities) > 0.03 * speeds
    first, last = times[moving.argmax(axis=0)], times[len(times) - 1 - moving[::-1].argmax(axis=0)]
    assert np.ptp(first) <= 2 * CYCLE_S + 1e-9
    assert np.ptp(last) <= 0.08
    assert (last - first).mean() == pytest.approx(total, abs=0.1)
    # Profile velocity stops by time: a cycle of delay is one cycle's way.
    allowed = speeds * CYCLE_S if by_velocity else np.full(6, 2e-4)
    assert np.all(np.abs(homed.places() - before - WAYS) < allowed)
    travel(homed, [-way for way in WAYS], False)


def test_in_profile_velocity_rpdo3_carries_the_speed_until_the_stop_time_of_each_axis(homed: Gantry) -> None:
    _, speeds, stops = together(WAYS, *quarter(homed))
    began, _, _ = travel(homed, WAYS, True)
    for node, (axis, way, speed, stop) in enumerate(zip(homed.axes, WAYS, speeds, stops, strict=True), start=1):
        sent = [(at, int.from_bytes(data, "little", signed=True)) for at, data in homed.since(began, 0x400 + node)]
        running = [at for at, counts in sent if counts]
        assert {counts for _, counts in sent} == {0, round(np.sign(way) * speed * axis.counts_per_unit)}
        ended = next(at for at, counts in sent if at > running[0] and not counts)
        assert ended - running[0] == pytest.approx(stop, abs=1.5 * CYCLE_S)
    travel(homed, [-way for way in WAYS], False)


def test_after_motions_of_its_own_it_follows_blocks_again(homed: Gantry) -> None:
    travel(homed, [0.05, 0, 0, 0, 0, 0], False)
    owner = homed.enabled()
    count = 100
    t = np.arange(count + 1) / count
    way = np.zeros((count + 1, 6))
    way[:, 0] = 0.05 * t**3 * (10 - 15 * t + 6 * t**2)
    speed = np.zeros((count + 1, 6))
    speed[:, 0] = 0.05 * 30 * t**2 * (1 - t) ** 2 / (count * CYCLE_S)
    start = homed.feedback.commanded
    block = SetpointBlock("gantry", owner, 1, 0, homed.feedback.tick + 5, CYCLE_S, count, start + way, speed)
    homed.tell(block)
    homed.run(1.5)
    assert homed.feedback.refused == 0
    assert homed.places() == pytest.approx(start + way[-1], abs=2e-4)
