"""Every family with a closed form against the numbers of its source."""

from typing import Any

import numpy as np
import pytest

from cell.geometry import to_xyz_abc
from robot_agent.kinematics import OpenMechanism, Unreachable
from tests.unit.robot_families import (
    CLOSED,
    VECTORS,
    described,
    off,
    pose_of,
    robot,
    units,
)


def cases(name: str) -> list[Any]:
    return [
        pytest.param(family, case, id=f"{family} {i + 1}")
        for family in CLOSED
        for i, case in enumerate(VECTORS[family].get(name, ()))
    ]


@pytest.mark.parametrize(("family", "case"), cases("forward"))
def test_forward_reproduces_the_vectors(family: str, case: dict[str, Any]) -> None:
    model = robot(family)
    found = to_xyz_abc(model.forward(units(model) * case["joints"]))
    np.testing.assert_allclose(
        found, np.append(np.array(case["pose"][:3]) / 1000, np.radians(case["pose"][3:])), atol=1e-8
    )


@pytest.mark.parametrize(("family", "case"), cases("inverse"))
def test_inverse_reproduces_every_branch_of_the_vectors(family: str, case: dict[str, Any]) -> None:
    model = robot(family, turn_deg=720)
    solutions = model.inverse(pose_of(case["pose"]))
    for branch, joints in case["branches"].items():
        slot = solutions.branches.index(branch)
        assert solutions.valid[slot]
        assert off(model, solutions.joints[slot], units(model) * joints).max() < 2e-7


@pytest.mark.parametrize("case", VECTORS["gantry"]["rotations"], ids=["1", "2"])
def test_the_gantry_reproduces_the_rotations_of_the_thesis(case: dict[str, Any]) -> None:
    gantry = robot("gantry")
    pose = gantry.forward(units(gantry) * case["joints"])
    np.testing.assert_allclose(pose[:3, :3], case["rows"], atol=1e-6)
    np.testing.assert_allclose(pose[:3, 3] * 1000, case["position"], atol=1e-9)
    for slot, branch in enumerate(gantry.branches):
        found = gantry.inverse(pose).joints[slot]
        assert off(gantry, found, units(gantry) * case["branches"][branch]).max() < 1e-9


def test_the_velocity_of_the_gantry_is_the_corrected_one() -> None:
    gantry, case = robot("gantry"), VECTORS["gantry"]["velocity"]
    jacobian = gantry.jacobian(units(gantry) * case["joints"])
    np.testing.assert_allclose(jacobian @ case["rates_si"], case["twist_si"], atol=1e-6)


@pytest.mark.parametrize(("family", "case"), cases("unreachable"))
def test_what_is_out_of_reach_says_which_way_and_how_far(family: str, case: dict[str, Any]) -> None:
    model = robot(family)
    with pytest.raises(Unreachable, match=case["reason"]) as caught:
        model.solve(pose_of(case["pose"]), branch=case.get("branch"))
    if "excess_mm" in case:
        assert caught.value.violation.excess_m * 1000 == pytest.approx(case["excess_mm"], abs=1e-3)


def test_axes_and_joints_of_the_palletizer_differ_by_its_coupling() -> None:
    model = robot("palletizer", coupling=np.array(VECTORS["palletizer"]["coupling"], dtype=float))
    for case in VECTORS["palletizer"]["forward"]:
        axes, joints = np.radians(case["axes"]), np.radians(case["joints"])
        np.testing.assert_allclose(model.coupling.joints(axes), joints, atol=1e-15)
        np.testing.assert_allclose(model.coupling.axes(joints), axes, atol=1e-15)


@pytest.mark.parametrize("case", VECTORS["scara"]["turns"])
def test_the_turn_of_the_spindle_is_chosen_before_its_height(case: dict[str, Any]) -> None:
    scara = robot("scara", turn_deg=720)
    pose = pose_of(VECTORS["scara"]["forward"][0]["pose"])
    found = scara.solve(pose, near=units(scara) * [30, 50, -45, case["j4_near"]])
    np.testing.assert_allclose(found / units(scara), [30, 50, case["j3"], case["j4"]], atol=1e-5)


def test_rods_that_do_not_meet_are_refused() -> None:
    lengths = described("delta").geometry | {"k": VECTORS["delta"]["open"]["k"] / 1000}
    model = robot("delta", geometry=lengths)
    with pytest.raises(OpenMechanism, match=r"joints\[1\]: found 0.00, 0.00, 0.00"):
        model.forward(np.radians([[85.0, 85, 85, 0], [0, 0, 0, 0]]))
