"""What a URDF says, looked at before Pinocchio reads it: Pinocchio tells the cause on standard error only, or nothing.

Format: http://wiki.ros.org/urdf/XML. Inertias are not looked at, nor what is seen (`urdf_visuals`).
"""

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

from robot_agent.kinematics.errors import BadModel

TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
LIMITED = ("revolute", "prismatic")
Element = ElementTree.Element


def check_urdf(file: Path) -> dict[str, str]:
    """Refuse what is no tree of links and joints; returns the joints that mimic another one, and which.

    Raises:
        BadModel: with everything that was found.
    """
    try:
        root = ElementTree.fromstring(file.read_bytes())
    except OSError as error:
        raise BadModel(file.name, (f"found no file {file} that can be read ({error.strerror})",)) from error
    except (ElementTree.ParseError, ValueError) as error:
        raise BadModel(file.name, (f"found no valid URDF: no XML, {error}",)) from error
    if root.tag != "robot":
        raise BadModel(file.name, (f"found no valid URDF: a document {root.tag!r}, allowed 'robot'",))
    joints = root.findall("joint")
    problems = tuple(dict.fromkeys([*_links(root), *(text for joint in joints for text in _joint(root, joint))]))
    problems = problems or tuple(_tree(root))
    if problems:
        raise BadModel(file.name, problems)
    mimics = ((joint.get("name", ""), joint.find("mimic")) for joint in joints)
    return {name: mimic.get("joint", "?") for name, mimic in mimics if mimic is not None}


def _links(root: Element) -> Iterator[str]:
    for kind in ("link", "joint"):
        names = [element.get("name", "") for element in root.findall(kind)]
        if kind == "link" and not names:
            yield "found no link"
        if "" in names:
            yield f"found a {kind} without a name"
        for name in sorted({name for name in names if name and names.count(name) > 1}):
            yield f"found {names.count(name)} {kind}s {name!r}, allowed names that are there once"


def _joint(root: Element, joint: Element) -> Iterator[str]:
    name, kind = joint.get("name", ""), joint.get("type", "")
    if kind not in TYPES:
        yield f"joint {name} is of type {kind!r}, allowed {', '.join(TYPES)}"
    links = {link.get("name") for link in root.findall("link")}
    for end in ("parent", "child"):
        link = _attribute(joint, end, "link")
        if link not in links:
            yield f"joint {name} has the {end} link {link!r}, which is not there"
    axis = joint.find("axis")
    if kind != "fixed" and axis is not None and not any(map(_number, axis.get("xyz", "").split())):
        yield f"joint {name} has the axis {axis.get('xyz', '')!r}, allowed three numbers that are not all zero"
    if kind in LIMITED:
        yield from _limit(joint, name)


def _limit(joint: Element, name: str) -> Iterator[str]:
    if joint.find("limit") is None:
        yield f"joint {name} has no limit, allowed limit with lower, upper, effort and velocity"
        return
    # The format takes a range that is not given as 0 to 0.
    lower, upper = (_number(_attribute(joint, "limit", which) or "0") for which in ("lower", "upper"))
    if lower is None or upper is None or not lower < upper:
        found = " to ".join(_attribute(joint, "limit", which) or "0" for which in ("lower", "upper"))
        yield f"joint {name} has the range {found}, allowed a lower limit below the upper one"
    for which in ("velocity", "effort"):
        value = _number(_attribute(joint, "limit", which) or "")
        if value is None or value < 0:
            yield f"joint {name} has a limit without {which}, allowed a number that is 0 or more"


def _tree(root: Element) -> Iterator[str]:
    """Every link but one has one parent: anything else is a closed loop, or more than one robot."""
    parents: dict[str, list[str]] = {}
    for joint in root.findall("joint"):
        parents.setdefault(_attribute(joint, "child", "link") or "", []).append(joint.get("name", ""))
    for link, joints in parents.items():
        if len(joints) > 1:
            yield f"link {link} hangs on the joints {', '.join(joints)}: a closed loop, allowed an open chain"
    roots = [name for link in root.findall("link") if (name := link.get("name", "")) not in parents]
    if not roots:
        yield "every link hangs on a joint: a closed loop, allowed an open chain with a base"
    elif len(roots) > 1:
        yield f"the links {', '.join(roots)} hang on no joint, allowed one base"


def _attribute(joint: Element, tag: str, name: str) -> str | None:
    element = joint.find(tag)
    return None if element is None else element.get(name)


def _number(text: str) -> float | None:
    """The finite number in a text; None where there is none."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if abs(value) < float("inf") else None
