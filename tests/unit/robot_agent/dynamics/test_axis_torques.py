"""Torques of the axes against published numbers, a hand-made Lagrange equation, and the balance of power."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.config import ConfigError
from cell.geometry import from_xyz_abc
from robot_agent.dynamics import GRAVITY_M_S2, AxisTorques, axis_torques
from robot_agent.kinematics import BadInput, Model, SixAxis, load_model, model_of
from robot_agent.model import LinkMass, Motor, Part, RobotDescription, Tool, UrdfSource, load_description
from robot_agent.model.description import Mounted
from tests.unit.config_world import CONFIGS, ROBOT, Copy
from tests.unit.repository import vectors
from tests.unit.robot_families import described, random_joints, robot
from tests.unit.six_axis_arm import description as arm_description

VECTORS: dict[str, Any] = vectors("dynamics.json")
ARM, PENDULUM = VECTORS["arm"], VECTORS["pendulum"]
BOOK_GRAVITY = np.array([0.0, 0.0, -9.81])
NO_INERTIA = np.zeros((3, 3))
SERIAL = ("six_axis", "cobot", "scara", "palletizer", "gantry")


def _motor(inertia: float, gear: float, feed_m: float | None = None) -> Motor:
    return Motor("m", "a test", gear, feed_m, 4, 3000, 6000, 3.0, 9.0, 1.0, inertia)


def _point_mass_arm() -> AxisTorques:
    masses = (LinkMass(6, ARM["mass_kg"], (0.0, 0.0, 0.0), NO_INERTIA, "a test"),)
    return AxisTorques(SixAxis(replace(arm_description(), masses=masses)), BOOK_GRAVITY)


def _unit(joint: int, value: float = 1.0) -> np.ndarray:
    row = np.zeros((1, 6))
    row[0, joint] = value
    return row


HOME = np.zeros((1, 6))


def test_gravity_loads_the_textbooks_arm_as_computed() -> None:
    np.testing.assert_allclose(_point_mass_arm().standing(HOME)[0], ARM["gravity_home"], atol=5e-5)


@pytest.mark.parametrize("speed", [1, 2])
def test_turning_about_the_base_loads_the_joints_behind_it(speed: int) -> None:
    torques = _point_mass_arm()
    extra = torques.of(HOME, _unit(0, speed), HOME) - torques.standing(HOME)
    np.testing.assert_allclose(extra[0], ARM[f"speed_j1_{speed}_rad_s"], atol=5e-5)


def test_inertia_depends_on_the_pose() -> None:
    torques, retracted = _point_mass_arm(), np.radians([ARM["retracted_deg"]])

    def inertia(joint: int, q: np.ndarray) -> float:
        return float((torques.of(q, HOME, _unit(joint)) - torques.standing(q))[0, joint])

    assert inertia(0, HOME) == pytest.approx(ARM["inertia_j1_home"], abs=5e-6)
    assert inertia(0, retracted) == pytest.approx(ARM["inertia_j1_retracted"], abs=5e-6)
    assert inertia(1, HOME) == pytest.approx(ARM["inertia_j2_home"], abs=5e-6)


PENDULUM_URDF = """<robot name="pendulum">
  <link name="base"><inertial><mass value="9"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="flange"><inertial><origin xyz="0 0 -0.3"/><mass value="2"/>
    <inertia ixx="0.06" iyy="0.06" izz="0.06" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="flange"/><axis xyz="0 -1 0"/>
    <limit lower="-3" upper="3" velocity="2" effort="0"/></joint>
</robot>"""


@pytest.mark.parametrize("key", ["without_motor_nm", "with_motor_nm"])
def test_a_rotor_behind_its_gear_adds_its_inertia_times_the_square_of_the_gear(tmp_path: Path, key: str) -> None:
    file = tmp_path / "pendulum.urdf"
    file.write_text(PENDULUM_URDF)
    motor = _motor(PENDULUM["motor_kg_m2"], PENDULUM["gear"])
    model = _of_urdf(file, 1, motors={"J1": motor} if key == "with_motor_nm" else {})
    at = [np.array([[PENDULUM[name]]]) for name in ("angle", "speed", "acceleration")]
    assert AxisTorques(model, BOOK_GRAVITY).of(*at)[0, 0] == pytest.approx(PENDULUM[key], abs=1e-9)


def _of_urdf(file: Path, n: int, **changed: Any) -> Model:
    like = described("six_axis")
    limits = replace(
        like.limits,
        position=np.tile([-2.5, 2.5], (n, 1)),
        velocity=np.ones(n),
        acceleration=np.ones(n),
        jerk=np.ones(n),
    )
    values: dict[str, Any] = {
        "family": "urdf", "geometry": {}, "urdf": UrdfSource(file, "flange"), "linear": (False,) * n,
        "joint_names": tuple(f"J{i + 1}" for i in range(n)), "home": np.zeros(n), "limits": limits,
        "capsules": like.capsules[:1],
    }  # fmt: skip
    return model_of(replace(like, **(values | changed)))


# Two links in the plane, on a wall: the Lagrange equations of every textbook.

L1, C1, C2, M1, M2, I1, I2 = 0.25, 0.11, 0.14, 7.0, 3.0, 0.05, 0.02


def _two_links() -> AxisTorques:
    """The arms of a SCARA whose base hangs at a wall: its X points up."""
    description = described(
        "scara",
        masses=(
            LinkMass(1, M1, (C1, 0.0, 0.3), np.diag([0.2, 0.3, I1]), "a test"),
            LinkMass(2, M2, (C2, 0.0, -0.1), np.diag([0.2, 0.3, I2]), "a test"),
        ),
    )
    lengths = description.geometry | {"a1x": L1, "a2x": 0.2}
    torques = axis_torques(
        model_of(replace(description, geometry=lengths)), from_xyz_abc(np.array([0, 0, 0, 0, -np.pi / 2, 0]))
    )
    assert torques is not None
    return torques


def _lagrange(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
    """Gravity acts along -X of the plane."""
    c2, s2 = np.cos(q[1]), np.sin(q[1])
    cross = M2 * L1 * C2
    m11 = M1 * C1**2 + I1 + M2 * (L1**2 + C2**2) + 2 * cross * c2 + I2
    m12 = M2 * C2**2 + I2 + cross * c2
    m22 = M2 * C2**2 + I2
    v1 = -cross * s2 * (2 * qd[0] * qd[1] + qd[1] ** 2)
    v2 = cross * s2 * qd[0] ** 2
    g2 = -M2 * GRAVITY_M_S2 * C2 * np.sin(q[0] + q[1])
    g1 = -(M1 * C1 + M2 * L1) * GRAVITY_M_S2 * np.sin(q[0]) + g2
    return np.array([m11 * qdd[0] + m12 * qdd[1] + v1 + g1, m12 * qdd[0] + m22 * qdd[1] + v2 + g2])


def test_two_links_on_a_wall_obey_lagrange() -> None:
    rng = np.random.default_rng(8)
    q, qd, qdd = np.zeros((3, 40, 4))
    for values in (q, qd, qdd):
        values[:, :2] = rng.uniform(-3, 3, (40, 2))
    expected = _lagrange(q.T, qd.T, qdd.T).T
    np.testing.assert_allclose(_two_links().of(q, qd, qdd)[:, :2], expected, atol=1e-9)


# Power is the change of energy, whatever the robot.


def _masses(links: int, rng: np.random.Generator) -> tuple[LinkMass, ...]:
    masses = []
    for link in range(1, links):
        spread = rng.normal(size=(3, 3))
        # Any body of points has this inertia; spread @ spread.T are its second moments.
        moments = spread @ spread.T * 0.1
        x, y, z = rng.uniform(-0.3, 0.3, 3).tolist()
        masses.append(LinkMass(link, rng.uniform(1, 20), (x, y, z), np.trace(moments) * np.eye(3) - moments, "a test"))
    return tuple(masses)


def _heavy(family: str, seed: int) -> Model:
    rng = np.random.default_rng(seed)
    bare = robot(family)
    tool = Tool("tool", np.eye(4), 4.0, (0.1, 0.05, -0.02), np.diag([0.1, 0.2, 0.25]), ())
    motors = {
        name: _motor(rng.uniform(1e-4, 1e-2), rng.uniform(5, 100), 0.1 if bare.linear[i] else None)
        for i, name in enumerate(bare.joint_names)
    }
    coupling = np.eye(bare.n) + np.tril(rng.uniform(-0.3, 0.3, (bare.n, bare.n)), -1)
    return robot(
        family,
        masses=_masses(len(bare.link_names), rng),
        motors=motors,
        coupling=coupling,
        tools={"tool": tool},
        mounted=Mounted(("tool",)),
    )


STEP_S = 1e-3
SLOPE = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12 * STEP_S)


def _slope(values: np.ndarray) -> np.ndarray:
    """Time derivative along the first axis, which becomes shorter by two at both ends."""
    return np.asarray(sum(weight * values[i : len(values) - 4 + i] for i, weight in enumerate(SLOPE)))


def _energy(model: Model, q: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Kinetic and potential energy `(k - 4,)` of links, tool and rotors over samples `(k, n)`, from poses alone."""
    description, poses = model.description, model.links(q)
    tool = description.tool
    assert tool is not None
    flange = len(model.link_names) - 1
    bodies = [*description.masses, LinkMass(flange, tool.mass_kg, tool.centre_m, tool.inertia_kg_m2, "tool")]
    energy = np.zeros(len(q) - 4)
    for body in bodies:
        pose = poses[:, body.link]
        centre = pose[:, :3, 3] + pose[:, :3, :3] @ np.array(body.centre_m)
        turning = np.einsum("kba,kbc->kac", pose[2:-2, :3, :3], _slope(pose[:, :3, :3]))
        spin = np.stack([turning[:, 2, 1], turning[:, 0, 2], turning[:, 1, 0]], axis=-1)
        energy += 0.5 * body.mass_kg * (_slope(centre) ** 2).sum(axis=1)
        energy += 0.5 * np.einsum("ka,ab,kb->k", spin, body.inertia_kg_m2, spin)
        energy += body.mass_kg * GRAVITY_M_S2 * centre[2:-2] @ up
    shafts = _slope(model.coupling.axes(q)) * [motor.ratio for motor in description.motors.values()]
    return energy + 0.5 * (shafts**2 @ [motor.inertia_kg_m2 for motor in description.motors.values()])


@settings(max_examples=15, deadline=None)
@given(st.sampled_from(SERIAL), st.integers(0, 10**6))
def test_the_power_of_all_axes_is_the_change_of_energy(family: str, seed: int) -> None:
    model, rng = _heavy(family, seed), np.random.default_rng(seed + 1)
    pose_world_base = from_xyz_abc(np.append(np.zeros(3), rng.uniform(-3, 3, 3)))
    torques = axis_torques(model, pose_world_base)
    assert torques is not None
    middle = random_joints(family, 1, seed=seed)
    swing = rng.uniform(0.1, 0.5, (2, model.n))
    t = np.arange(-4, 5)[:, None] * STEP_S
    q = middle + swing[0] * np.sin(3 * t) + swing[1] * t**2
    qd = 3 * swing[0] * np.cos(3 * t) + 2 * swing[1] * t
    qdd = -9 * swing[0] * np.sin(3 * t) + 2 * swing[1]
    power = (torques.of(q[4:5], qd[4:5], qdd[4:5]) * model.coupling.axes(qd[4:5])).sum()
    change = float(_slope(_energy(model, q, pose_world_base[2, :3]))[0])
    assert power == pytest.approx(change, rel=1e-6, abs=1e-4)


# Where masses come from


FINGER_URDF = """<robot name="arm">
  <link name="base"/>
  {links}
  <link name="plate"><inertial><origin xyz="0.1 0 0.05" rpy="0.3 0 0"/><mass value="3"/>
    <inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0.001" ixz="0" iyz="0.002"/></inertial></link>
  <link name="flange"/>
  <link name="finger"><inertial><origin xyz="0 0.1 0"/><mass value="0.7"/>
    <inertia ixx="0.002" iyy="0.002" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="j1" type="revolute"><parent link="base"/><child link="l1"/><origin xyz="0 0 0.4"/>
    <axis xyz="0 0 1"/><limit lower="-3" upper="3" velocity="2" effort="0"/></joint>
  <joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/><origin xyz="0.2 0.1 0" rpy="0.2 0.4 -0.1"/>
    <axis xyz="0.6 0.8 0"/><limit lower="-3" upper="3" velocity="2" effort="0"/></joint>
  <joint name="j3" type="revolute"><parent link="l2"/><child link="l3"/><origin xyz="0 0 0.5"/>
    <axis xyz="0 -0.6 0.8"/><limit lower="-3" upper="3" velocity="2" effort="0"/></joint>
  <joint name="bolts" type="fixed"><parent link="l3"/><child link="plate"/>
    <origin xyz="0.1 0 0" rpy="0 0.5 0"/></joint>
  <joint name="mount" type="fixed"><parent link="plate"/><child link="flange"/>
    <origin xyz="0 0 0.1" rpy="1 0 0"/></joint>
  <joint name="hinge" type="revolute"><parent link="l3"/><child link="finger"/><origin xyz="0 0.2 0"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" velocity="2" effort="0"/></joint>
</robot>"""
LINK = """<link name="l{0}"><inertial><origin xyz="0.05 0 0.{0}" rpy="0 0.{0} 0"/><mass value="{0}.5"/>
    <inertia ixx="0.3" iyy="0.2" izz="0.25" ixy="0.01" ixz="0.02" iyz="0"/></inertial></link>"""


def test_the_masses_of_a_urdf_count_with_all_that_is_fixed_to_them(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(FINGER_URDF.format(links="".join(LINK.format(i) for i in (1, 2, 3))))
    whole = pin.buildModelFromUrdf(str(file))
    data, rng = whole.createData(), np.random.default_rng(2)
    torques = axis_torques(_of_urdf(file, 3), np.eye(4))
    assert torques is not None
    moving = [whole.joints[whole.getJointId(name)].idx_v for name in ("j1", "j2", "j3")]
    whole.gravity.linear = np.array([0.0, 0.0, -GRAVITY_M_S2])
    for at in rng.uniform(-2, 2, (10, 3, 3)):
        full = np.zeros((3, whole.nv))
        full[:, moving] = at
        expected = pin.rnea(whole, data, *full)[moving]
        np.testing.assert_allclose(torques.of(*at[:, None])[0], expected, atol=1e-9)


def test_a_part_counts_where_the_gripper_holds_it(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(FINGER_URDF.format(links="".join(LINK.format(i) for i in (1, 2, 3))))
    whole, rng = pin.buildModelFromUrdf(str(file)), np.random.default_rng(3)
    pose_flange_tcp = from_xyz_abc(np.array([0.1, -0.2, 0.15, 0.4, -0.7, 1.1]))
    inertia = np.array([[0.05, 0.004, 0.0], [0.004, 0.03, -0.002], [0.0, -0.002, 0.06]])
    tool = Tool("tool", pose_flange_tcp, 0.0, (0.0, 0.0, 0.0), NO_INERTIA, ())
    parts = {
        "casting": Part("casting", 6.0, (0.1, 0.2, -0.05), inertia, ()),
        "other": Part("other", 60.0, (0.0, 0.0, 0.0), NO_INERTIA, ()),
    }
    has = {"tools": {"tool": tool}, "parts": parts}
    torques = axis_torques(_of_urdf(file, 3, **has, mounted=Mounted(("tool",), ("casting",))), np.eye(4))
    unknown = axis_torques(_of_urdf(file, 3, **has, mounted=Mounted(("tool",), ("casting", "other"))), np.eye(4))
    bare = axis_torques(_of_urdf(file, 3), np.eye(4))
    assert torques is not None
    assert unknown is not None
    assert bare is not None
    placement = whole.frames[whole.getFrameId("flange")].placement * pin.SE3(pose_flange_tcp)
    whole.appendBodyToJoint(whole.getJointId("j3"), pin.Inertia(6.0, np.array([0.1, 0.2, -0.05]), inertia), placement)
    whole.gravity.linear = np.array([0.0, 0.0, -GRAVITY_M_S2])
    data = whole.createData()
    moving = [whole.joints[whole.getJointId(name)].idx_v for name in ("j1", "j2", "j3")]
    for at in rng.uniform(-2, 2, (10, 3, 3)):
        full = np.zeros((3, whole.nv))
        full[:, moving] = at
        np.testing.assert_allclose(torques.of(*at[:, None])[0], pin.rnea(whole, data, *full)[moving], atol=1e-9)
        np.testing.assert_array_equal(unknown.of(*at[:, None]), bare.of(*at[:, None]))


def test_a_delta_has_the_torques_of_its_rotors_alone() -> None:
    motors = {f"J{i + 1}": _motor(1e-3, 30.0) for i in range(4)}
    model = robot("delta", motors=motors, masses=_masses(8, np.random.default_rng(1)))
    torques = axis_torques(model, np.eye(4))
    assert torques is not None
    still = np.zeros((1, 4))
    np.testing.assert_allclose(torques.of(still, still, still + 2.0), 1e-3 * 30.0**2 * 2.0)
    np.testing.assert_array_equal(torques.standing(still), still)


def test_of_a_robot_without_masses_and_motors_nobody_knows_the_torques() -> None:
    assert axis_torques(robot("six_axis"), np.eye(4)) is None


def test_values_that_are_not_finite_are_refused() -> None:
    with pytest.raises(BadInput, match="joint speeds"):
        _point_mass_arm().of(HOME, np.full((1, 6), np.nan), HOME)


# The robot file


def test_the_example_arm_stands_by_less_than_its_motors_give_for_unlimited_time() -> None:
    robots: RobotDescription = load_description(CONFIGS / ROBOT)
    torques = axis_torques(load_model(CONFIGS / ROBOT), np.eye(4))
    assert torques is not None
    assert all("estimate" in mass.source for mass in robots.masses)
    stretched = np.radians([[0, 90, -78, 0, 0, 0], [0, -35, 35, 0, 90, 0], [0, 90, 0, 90, 90, 0]])
    rated = np.array([motor.rated_torque_nm * motor.ratio for motor in robots.motors.values()])
    assert (np.abs(torques.standing(stretched)) < rated).all()
    assert np.abs(torques.standing(stretched)[0, 1]) > 0.5 * rated[1]


MASS = "masses:\n  - {{link: {link}, mass_kg: 4, centre: [0, 0, 10], inertia_kg_m2: {inertia}, source: a test}}"
BODY = "[0.1, 0.1, 0.1, 0, 0, 0]"


@pytest.mark.parametrize(
    ("name", "line", "problem"),
    [
        (ROBOT, MASS.format(link=7, inertia=BODY), "masses[0].link: found 7, allowed 1 to 6 (flange)"),
        (ROBOT, MASS.format(link=1, inertia="[0.1, 0.1, 0.3, 0, 0, 0]"),
         "masses[0].inertia_kg_m2: found main moments 0.1, 0.1, 0.3, allowed none below 0, none above the sum of the "
         "others: no body is made so"),
        (ROBOT, f"{MASS.format(link=2, inertia=BODY)}\n{MASS.format(link=2, inertia=BODY)[8:]}",
         "masses[1].link: found 2 for the second time, allowed each link once"),
        ("models/delta.yaml", MASS.format(link=1, inertia=BODY),
         "masses: found masses in family delta, allowed none: its arms are closed chains, whose torques are not "
         "computed"),
        ("models/painter.yaml", MASS.format(link=1, inertia=BODY),
         "masses: found masses in family urdf, allowed none here: the masses of such a robot are in its URDF"),
    ],
)  # fmt: skip
def test_masses_that_cannot_be_are_refused(tmp_path: Path, name: str, line: str, problem: str) -> None:
    copy = Copy(tmp_path)
    file = copy.folder / name
    text = file.read_text()
    if "\nmasses:" in text:
        start = text.index("\nmasses:") + 1
        text = text[:start] + text[text.index("\npath:") + 1 :]
    file.write_text(f"{text}{line}\n")
    with pytest.raises(ConfigError, match=re.escape(problem)):
        load_description(file)
