"""The checks of the simulation can fail: each is shown a cell in which one safeguard is taken away."""

import pytest

from cell.manager.core import ManagerCore
from robot_agent.agent.zones.zone_claims import ZoneClaims
from tests.sim import invariants, planned_paths
from tests.sim.invariants import Broken
from tests.sim.network import Weather
from tests.sim.scenario import run_scenario

CALM = Weather(loss=0.0, double=0.0, late=0.0)


@pytest.fixture
def agents_ignore_grants(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ZoneClaims, "permitted", lambda *_: True)


@pytest.mark.soak
@pytest.mark.usefixtures("agents_ignore_grants")
def test_two_bodies_in_the_zone_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ManagerCore, "_intruded", lambda *_: None)
    with pytest.raises(Broken, match="in zone handover together"):
        run_scenario(1, CALM, longest_s=10.0)


@pytest.mark.soak
@pytest.mark.usefixtures("agents_ignore_grants")
def test_the_manager_stops_agents_that_ignore_grants_before_their_bodies_meet() -> None:
    outcome = run_scenario(1, CALM, longest_s=6.0)
    assert any(event.code == "zone_breach" for event in outcome.world.seen.events)


def test_samples_beyond_the_limits_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(invariants, "_LIMIT_TOLERANCE", 0.5)
    with pytest.raises(Broken, match=r"velocity|acceleration|jerk"):
        run_scenario(1, CALM, longest_s=10.0)


def test_samples_off_the_planned_path_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(planned_paths, "PATH_STEP_S", 0.5)
    with pytest.raises(Broken, match="off every planned path"):
        run_scenario(1, CALM, longest_s=10.0)
