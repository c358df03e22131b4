"""The masses in a URDF, link by link along the way to the flange."""

import pinocchio as pin

from robot_agent.model.description import LinkMass


def urdf_masses(model: pin.Model, joints: list[int], flange: pin.Frame, file: str) -> tuple[LinkMass, ...]:
    """Masses of the links behind `joints`, each in its link's frame; the last link is the flange.

    What is fixed to a link counts with it, and so does what hangs on it beside the way to the flange, with joints at
    zero.
    """
    aside = [joint for joint in range(1, model.njoints) if joint not in joints]
    rigid = pin.buildReducedModel(model, aside, pin.neutral(model))
    masses = []
    for link, joint in enumerate(joints, start=1):
        inertia = rigid.inertias[rigid.getJointId(model.names[joint])]
        if inertia.mass <= 0.0:
            continue
        if link == len(joints):
            inertia = inertia.se3Action(flange.placement.inverse())
        x, y, z = inertia.lever.tolist()
        masses.append(LinkMass(link, float(inertia.mass), (x, y, z), inertia.inertia.copy(), file))
    return tuple(masses)
