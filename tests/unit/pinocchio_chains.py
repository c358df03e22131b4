"""Pinocchio models of the families that are one chain, built from their tables, joint by joint.

Each is the peer and what makes its coordinates of the joints, `(s, n)`.
"""

import numpy as np
import pinocchio as pin

Lengths = dict[str, float]


def chain(*joints: tuple[object, tuple[float, float, float] | pin.SE3]) -> pin.Model:
    model, parent = pin.Model(), 0
    for i, (kind, offset) in enumerate(joints):
        placement = offset if isinstance(offset, pin.SE3) else pin.SE3(np.eye(3), np.array(offset, dtype=float))
        parent = model.addJoint(parent, kind(), placement, f"j{i}")  # type: ignore[operator]
    return model


def cobot(g: Lengths) -> tuple[pin.Model, np.ndarray]:
    y, z = pin.JointModelRY, pin.JointModelRZ
    offsets = [(0, 0, 0), (0, g["a1y"], g["a1z"]), (g["a2x"], g["a2y"], 0), (g["a3x"], g["a3y"], 0)]
    offsets += [(0, 0, g["a4z"]), (0, g["a5y"], 0)]
    return chain(*zip((z, y, y, y, z, y), offsets, strict=True)), np.eye(6)


def six_axis(g: Lengths) -> tuple[pin.Model, np.ndarray]:
    """The flange as a joint that does not turn."""
    x, y, z = pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ
    offsets = [(0, 0, g["a1z"]), (g["a2x"], 0, g["a2z"]), (0, 0, g["a3z"]), (g["a4x"], 0, g["a4z"]), (g["a5x"], 0, 0)]
    offsets += [(0, 0, 0), (g["a6x"], 0, 0)]
    return chain(*zip((z, y, y, x, y, x, x), offsets, strict=True)), np.eye(7)[:, :6]


def scara(g: Lengths) -> tuple[pin.Model, np.ndarray]:
    """The spindle as two slides, one of which is driven by J4."""
    z, slide = pin.JointModelRZ, pin.JointModelPZ
    model = chain(
        (z, (0, 0, 0)),
        (z, (g["a1x"], 0, g["a1z"])),
        (slide, (g["a2x"], 0, g["a2z"])),
        (z, (0, 0, 0)),
        (slide, (0, 0, 0)),
    )
    mixing = np.zeros((5, 4))
    mixing[:4] = np.eye(4)
    mixing[4, 3] = g["a4z"] / (2 * np.pi)
    return model, mixing


def palletizer(g: Lengths) -> tuple[pin.Model, np.ndarray]:
    y, z = pin.JointModelRY, pin.JointModelRZ
    offsets = [(0, 0, 0), (g["a1x"], 0, g["a1z"]), (0, 0, g["a2z"]), (g["a3x"], 0, 0), (g["a4x"], 0, g["a4z"])]
    mixing = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, -1, -1, 0], [0, 0, 0, 1]])
    return chain(*zip((z, y, y, y, z), offsets, strict=True)), mixing


def gantry(g: Lengths) -> tuple[pin.Model, np.ndarray]:
    """The thesis' table, modified Denavit-Hartenberg: Rx(alpha) Rz(theta), then the joint along or about Z."""
    table = [(90, 90), (90, 90), (90, 0), (0, None), (-90, None), (90, None)]
    joints = []
    for alpha, theta in table:
        rotation = pin.utils.rotate("x", np.radians(alpha)) @ pin.utils.rotate("z", np.radians(theta or 0))
        kind = pin.JointModelRZ if theta is None else pin.JointModelPZ
        joints.append((kind, pin.SE3(rotation, np.zeros(3))))
    joints.append((pin.JointModelPZ, (0, 0, g["a6z"])))
    return chain(*joints), np.eye(7)[:, :6]


CHAINS = {"six_axis": six_axis, "cobot": cobot, "scara": scara, "palletizer": palletizer, "gantry": gantry}
