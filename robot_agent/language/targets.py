"""Where a move leads: coordinates in a frame, or a point by its name."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

from cell.config.points_file import JointPoint, Point
from cell.config.problem import near
from robot_agent.language.names import Names
from robot_agent.language.steps import BASE, Aim, Orientation, Position
from robot_agent.language.words import Mistake, Word

_KEPT: Position = (None, None, None)
_POINT = re.compile(r"(?P<letter>[PQ])(?:\s*=\s*(?P<name>\S+)|(?P<number>[0-9]{1,6}))", re.IGNORECASE)
_FRAME = re.compile(r"Z(?:\s*=\s*(?P<name>[A-Za-z_]\w*)|(?P<number>[0-9]{1,6}))", re.IGNORECASE)
_NUMBER = re.compile(r"[0-9]{1,6}")
_BRANCH = re.compile(r"BRANCH\s*=\s*(?P<name>\S+)", re.IGNORECASE)
_NO_FRAMES = ("nan", "inf", "infinity")
"""What Python takes as a number."""


class NoTarget(Exception):
    """The program has come to a point to which it cannot send the robot; the text says why, for people."""


@dataclass(frozen=True, slots=True)
class Aims:
    """What a line says of its target beside coordinates, and its other words."""

    target: Aim
    via: Aim
    """Of `Q`."""
    words: list[Word]

    def refuse(self, names: Mapping[str, object], head: Word) -> None:
        """Raises Mistake where the line gives coordinates and a point at once, or a branch and neither."""
        if self.target.point and names:
            beside = f"{' '.join(names)} beside the point {self.target.point}"
            raise Mistake(head.column, beside, "a point or coordinates; the frame of both may be named: Z=name")
        if self.target.branch and not (self.target.point or names):
            raise Mistake(head.column, "BRANCH without a pose", "BRANCH beside P or X Y Z A B C")


def aims(words: list[Word], names: Names, *, via: bool = False, branch: bool = False) -> Aims:
    """`P`, `Z=frame` and, where they are allowed, `Q` and `BRANCH`, taken out of the words after the first.

    Raises Mistake for points, frames and branches that are not known, and for a second one of a kind.
    """
    rest, said = words[:1], dict[str, str]()
    for word in words[1:]:
        found = _said(word, names, via, branch)
        if found is None:
            rest.append(word)
            continue
        kind, value = found
        if kind in said:
            raise Mistake(word.column, f"`{word.text}`, a second {kind}", "each once")
        said[kind] = value
    frame = said.get("frame")
    target = Aim(said.get("point", ""), frame, said.get("branch", ""))
    return Aims(target, Aim(said.get("via point", ""), frame), rest)


def _said(word: Word, names: Names, via: bool, branch: bool) -> tuple[str, str] | None:
    """What kind of name a word gives, and which; None where it is another word."""
    joints = {joint.upper() for joint in names.joints}
    if (frame := frame_in(word, names)) is not None:
        return "frame", frame
    if (match := _POINT.fullmatch(word.text)) and match["letter"].upper() not in joints:
        if match["letter"].upper() == "Q" and not via:
            raise Mistake(word.column, f"`{word.text}`", "a via point on MC only")
        number = match["number"] or (match["name"] if _NUMBER.fullmatch(match["name"]) else None)
        point = match["name"] if number is None else f"P{int(number)}"
        if names.points is not None and point not in names.points.named:
            none = "a point of its points file, which has none: cell teach ROBOT NAME"
            raise Mistake(word.column, f"unknown point `{point}`", near(point, names.points.named, none))
        return ("via point" if match["letter"].upper() == "Q" else "point"), point
    if branch and (match := _BRANCH.fullmatch(word.text)) and "BRANCH" not in joints:
        return "branch", match["name"].upper()
    return None


def frame_in(word: Word, names: Names) -> str | None:
    """The frame that a word names; None where it is another word, such as the coordinate Z. Raises Mistake."""
    match = _FRAME.fullmatch(word.text)
    if match is None or (match["name"] or "").lower() in _NO_FRAMES:
        return None
    if match["number"] is not None and int(match["number"]) == 0:
        return BASE
    frame = match["name"] or f"z{int(match['number'])}"
    if names.frames is not None and frame not in names.frames:
        none = "Z0, the robot's base; the cell file has no frames"
        raise Mistake(word.column, f"unknown frame `{frame}`", f"{near(frame, names.frames, none)}; Z0 is the base")
    return frame


def settled(
    aim: Aim,
    position_m: Position,
    orientation_abc: Orientation | None,
    points: Mapping[str, Point],
    active: str,
) -> tuple[Position, Orientation | None, Aim]:
    """The target as the program means it where it comes to it, with this frame active. Raises `NoTarget`."""
    if not aim.point:
        return position_m, orientation_abc, replace(aim, frame=active if aim.frame is None else aim.frame)
    point = points.get(aim.point)
    if point is None:
        none = f"none: cell teach ROBOT {aim.point}"
        raise NoTarget(f"no point {aim.point} in the points file any more, but {near(aim.point, points, none)}")
    if isinstance(point, JointPoint):
        if aim.frame is not None or aim.branch:
            beside = "BRANCH" if aim.branch else "Z"
            raise NoTarget(f"point {aim.point} is given by joints, without frame and branch: leave {beside} out")
        return _KEPT, None, replace(aim, frame=BASE, joints=point.joints)
    frame = next(name for name in (aim.frame, point.frame, active) if name is not None)
    branch = aim.branch or point.branch or ""
    return point.position_m, point.orientation_abc, replace(aim, frame=frame, branch=branch, tool=point.tool)
