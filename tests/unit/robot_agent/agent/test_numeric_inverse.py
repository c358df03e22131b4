"""Robots whose inverse iterates: the agent's loop goes on from where they are, and does not search elsewhere."""

import numpy as np
import pytest

from cell.core import Effect
from cell.geometry.arrays import Array
from cell.messages import Enable, Heard, Jog, JogFrame, JogHeld, Mode
from robot_agent.kinematics import NumericModel, load_model
from robot_agent.kinematics.numeric.least_squares import Found
from tests.unit.agent_runs import until
from tests.unit.agent_world import AgentWorld
from tests.unit.measured_world import Measured
from tests.unit.repository import ROOT

PAINTER = ROOT / "cell_configs/models/painter.yaml"
STRETCHED = np.radians([23.7, -29.1, 61.0, -6.9, 120.0, 3.9])
"""Joints near which the flange cannot go much farther."""
MOST_CALLS, MOST_HOPELESS = 40, 16
"""Of the solver in one step of the agent; and those of them that found no joints for all of their poses."""


class Counted:
    """The solver's work within each step of an agent."""

    def __init__(self, world: AgentWorld, monkeypatch: pytest.MonkeyPatch) -> None:
        self.steps: list[list[bool]] = []
        """For each call of the solver whether it solved all."""
        self._within = False
        step, iterate, inverse = world.agent.step, NumericModel.iterate, NumericModel.inverse

        def counted_step(now: float) -> list[Effect]:
            self.steps.append([])
            self._within = True
            effects = list(step(now))
            self._within = False
            return effects

        def counted(model: NumericModel, *order: object) -> Found:
            found = iterate(model, *order)
            if self._within:
                self.steps[-1].append(bool(found.solved.all()))
            return found

        def counted_inverse(model: NumericModel, poses: Array, near: Array | None = None) -> object:
            assert not self._within, "a search all over the reach, in the loop"
            return inverse(model, poses, near)

        monkeypatch.setattr(world.agent, "step", counted_step)
        monkeypatch.setattr(NumericModel, "iterate", counted)
        monkeypatch.setattr(NumericModel, "inverse", counted_inverse)

    def check(self) -> None:
        assert any(False in calls for calls in self.steps), "nothing was in the way"
        assert max(len(calls) for calls in self.steps) <= MOST_CALLS
        assert max(calls.count(False) for calls in self.steps) <= MOST_HOPELESS


def test_jog_to_the_edge_of_the_reach_never_searches_for_what_is_in_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    world = AgentWorld("HOME\nEND", arm=load_model(PAINTER))
    world.commanded = STRETCHED
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    counted = Counted(world, monkeypatch)
    world.call(Jog("one", "Y", -0.175, JogFrame.TOOL, None))
    for _ in range(150):
        held = JogHeld("left", "one", True, Heard(world.state.boot, world.state.sequence))
        world.agent.receive(held, world.now)
        world.step()
    assert world.state.waiting_for == "at the edge of the robot's reach"
    counted.check()


def test_correction_that_leads_out_of_the_reach_never_searches_there(monkeypatch: pytest.MonkeyPatch) -> None:
    world = Measured("HOME\nTRACK wide\nMJ J1=5 F=5\nWAIT 60\nEND", load_model(PAINTER))
    world.start()
    world.until_line(3)
    counted = Counted(world, monkeypatch)
    for step in range(250):
        world.offset_m = (min(0.02 * step, 1.9), 0.0, 0.0)
        world.step()
    assert np.ptp(world.places()[-10:], axis=0).max() == 0.0, "it stands before it is where it is led"
    counted.check()
