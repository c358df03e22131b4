"""The DC bus: charging, discharging, energy back and forth, the chopper."""

from dataclasses import replace
from typing import Any

import pytest

from drive_gateway.sim.axis.dc_bus import DcBus, DcBusData
from tests.unit.repository import vectors

VECTORS = vectors("motor.json")
BLEEDER = VECTORS["bleeder"]
SMALL = DcBusData(supply_v=48.0, precharge_a=1.0, capacitance_f=13e-3, chopper_v=80.0, low_v=30.0, high_v=90.0)
WITHIN = 0.01


@pytest.mark.parametrize("vector", VECTORS["precharge"], ids=str)
def test_capacitors_are_charged_with_a_constant_current(vector: dict[str, float]) -> None:
    data = replace(
        SMALL, capacitance_f=vector["farad"], supply_v=vector["volts"], precharge_a=vector["amperes"], chopper_v=1e3
    )
    bus, time_s = DcBus(data, 0.0), 0.0
    while not bus.charged:
        bus.advance(1e-3, 0.0)
        time_s += 1e-3
    assert time_s == pytest.approx(0.95 * vector["seconds"], rel=WITHIN)


@pytest.mark.parametrize(("energy_j", "volts"), [(-10.0, 61.988), (10.0, 27.668)])
def test_energy_changes_the_square_of_the_voltage(energy_j: float, volts: float) -> None:
    bus = DcBus(SMALL)
    bus.switch_supply(False)
    bus.advance(0.01, energy_j)
    assert bus.voltage == pytest.approx(volts, rel=WITHIN)


@pytest.mark.parametrize("vector", VECTORS["stored"], ids=str)
def test_three_quarters_of_the_stored_energy_are_half_of_the_voltage(vector: dict[str, float]) -> None:
    bus = DcBus(replace(SMALL, capacitance_f=vector["farad"]), vector["volts"])
    bus.switch_supply(False)
    bus.advance(0.01, 0.75 * vector["joule"])
    assert bus.voltage == pytest.approx(0.5 * vector["volts"], rel=WITHIN)


@pytest.mark.parametrize("vector", BLEEDER["volts_by_s"], ids=lambda vector: f"{vector['farad']} F")
def test_bus_discharges_by_itself(vector: dict[str, Any]) -> None:
    """Through a thousandth of the resistor, in a thousandth of the time."""
    for seconds, volts in zip(vector["times"], vector["volts"], strict=True):
        bus = DcBus(DcBusData(bleeder_ohm=BLEEDER["ohm"] / 1e3, capacitance_f=vector["farad"]), BLEEDER["start_v"])
        bus.switch_supply(False)
        bus.advance(seconds / 1e3, 0.0)
        assert bus.voltage == pytest.approx(volts, rel=WITHIN)


def test_chopper_turns_what_comes_back_into_heat() -> None:
    bus = DcBus(DcBusData())
    bus.advance(2.0, -2 * 8000.0)
    data = bus.data
    assert data.chopper_v < bus.voltage < data.high_v
    assert bus.duty * bus.voltage**2 / data.chopper_ohm == pytest.approx(8000.0, rel=WITHIN)


def test_one_axis_uses_what_another_gives_back() -> None:
    bus = DcBus(DcBusData())
    for k in range(1, 100):
        bus.take(-30.0, 0.004 * k)
        bus.take(30.0, 0.004 * k)
    assert bus.voltage == pytest.approx(560.0, rel=1e-3)


def test_lost_mains_let_the_voltage_fall_below_its_limit() -> None:
    bus = DcBus(DcBusData())
    bus.switch_supply(False)
    bus.advance(0.2, 400.0)
    assert bus.voltage < bus.data.low_v
    assert not bus.charged
