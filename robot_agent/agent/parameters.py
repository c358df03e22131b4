"""What an operator may change at run time, each declared once: name, unit, range, meaning, and when it counts.

Everything else of a robot is in its files, and changes with a restart. What is set here is gone with the agent.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

from cell.config.problem import near
from cell.config.settings import PathWindow
from cell.messages import ParameterStatus, Severity
from robot_agent.model.description import ProfileKind
from robot_agent.trajectory import Limits

MANUAL_SPEED_M_S = 0.25
"""Reduced speed of manual operation (ISO 10218-1)."""
RETURN_SPEED = 0.1
"""Share of the joints' speed limits on the way back; the TCP is bound as in manual operation besides."""


class Level(Enum):
    """Who is meant to change it. Nobody is asked who he is."""

    OPERATE = "operate"
    """Whoever runs the cell."""
    CONFIGURE = "configure"
    """Whoever sets the robot up for its task: it changes what a program drives, or what counts as on its path."""


class Counts(Enum):
    """From when on."""

    AT_ONCE = "at once"
    NEXT_MOTION = "with the next motion that begins at rest"


@dataclass(frozen=True, slots=True)
class Tuning:
    """What is set, SI; None: as the files say. Shares are of the limits of the robot file."""

    filter_s: float | None = None
    blend_m: float | None = None
    path_speed_m_s: float | None = None
    path_turn_rad_s: float | None = None
    joint_speed: float | None = None
    joint_acceleration: float | None = None
    manual_speed_m_s: float | None = None
    return_speed: float | None = None
    window_turn_rad: float | None = None
    window_slide_m: float | None = None

    def within(self, limits: Limits) -> Limits:
        """The limits that motions are planned with; what braking ramps may use stays."""
        slower, softer = self.joint_speed or 1.0, self.joint_acceleration or 1.0
        down, shaping, path = limits.acceleration_down, limits.shaping, limits.path
        return replace(
            limits,
            velocity=limits.velocity * slower,
            acceleration=limits.acceleration * softer,
            acceleration_down=None if down is None else down * softer,
            jerk=limits.jerk * softer,
            ramp_factor=limits.ramp_factor / softer,
            path=replace(
                path,
                speed_m_s=_given(self.path_speed_m_s, path.speed_m_s),
                angular_speed_rad_s=_given(self.path_turn_rad_s, path.angular_speed_rad_s),
            ),
            shaping=replace(
                shaping,
                filter_s=_given(self.filter_s, shaping.filter_s),
                blend_m=_given(self.blend_m, shaping.blend_m),
            ),
        )

    def of_plans(self) -> "Tuning":
        """What of it shapes motions."""
        return replace(self, manual_speed_m_s=None, return_speed=None, window_turn_rad=None, window_slide_m=None)


AS_FILED = Tuning()


@dataclass(frozen=True, slots=True)
class Filed:
    """What the files of a robot say."""

    limits: Limits
    window: PathWindow


@dataclass(frozen=True, slots=True)
class Parameter:
    """One that may be set. Numbers are in `unit`, which is `si` of the SI unit; a percent is 0.01 of a share."""

    name: str
    field: str
    """Of `Tuning`."""
    unit: str
    si: float
    lowest: Callable[[Filed], float]
    highest: Callable[[Filed], float]
    filed: Callable[[Filed], float]
    """What counts where it is not set, SI."""
    does: str
    counts: Counts
    level: Level


def _given(value: float | None, filed: float) -> float:
    return filed if value is None else value


def _always(value: float) -> Callable[[Filed], float]:
    return lambda _: value


def _least_filter_ms(filed: Filed) -> float:
    return 1.0 if filed.limits.shaping.profile is ProfileKind.TRAPEZOIDAL else 0.0


_DEG, _MM, _MS, _PERCENT = math.radians(1.0), 1e-3, 1e-3, 1e-2
PARAMETERS = (
    Parameter(
        "filter", "filter_s", "ms", _MS, _least_filter_ms, _always(1000.0), lambda filed: filed.limits.shaping.filter_s,
        "window of the filter on every axis; longer is smoother, farther from the path, and takes longer",
        Counts.NEXT_MOTION, Level.CONFIGURE,
    ),
    Parameter(
        "blend", "blend_m", "mm", _MM, _always(0.001), _always(1.0), lambda filed: filed.limits.shaping.blend_m,
        "how far blending a step of the curvature may leave the programmed curve",
        Counts.NEXT_MOTION, Level.CONFIGURE,
    ),
    Parameter(
        "path_speed", "path_speed_m_s", "mm/s", _MM, _always(1.0), lambda filed: filed.limits.path.speed_m_s / _MM,
        lambda filed: filed.limits.path.speed_m_s,
        "largest speed of the TCP along a path",
        Counts.NEXT_MOTION, Level.OPERATE,
    ),
    Parameter(
        "path_turn", "path_turn_rad_s", "deg/s", _DEG, _always(1.0),
        lambda filed: filed.limits.path.angular_speed_rad_s / _DEG, lambda filed: filed.limits.path.angular_speed_rad_s,
        "largest angular speed of the TCP along a path",
        Counts.NEXT_MOTION, Level.OPERATE,
    ),
    Parameter(
        "joint_speed", "joint_speed", "%", _PERCENT, _always(1.0), _always(100.0), _always(1.0),
        "share of the joints' speed limits that programs use",
        Counts.NEXT_MOTION, Level.OPERATE,
    ),
    Parameter(
        "joint_acceleration", "joint_acceleration", "%", _PERCENT, _always(10.0), _always(100.0), _always(1.0),
        "share of the joints' limits of acceleration and jerk that programs use; braking ramps keep theirs",
        Counts.NEXT_MOTION, Level.OPERATE,
    ),
    Parameter(
        "manual_speed", "manual_speed_m_s", "mm/s", _MM, _always(10.0), _always(MANUAL_SPEED_M_S / _MM),
        _always(MANUAL_SPEED_M_S),
        "largest speed of flange and TCP in manual operation (`cell manual`)",
        Counts.AT_ONCE, Level.OPERATE,
    ),
    Parameter(
        "return_speed", "return_speed", "%", _PERCENT, _always(1.0), _always(25.0), _always(RETURN_SPEED),
        "share of the joints' speed limits on the way back to the path (`cell return`)",
        Counts.NEXT_MOTION, Level.OPERATE,
    ),
    Parameter(
        "window_turn", "window_turn_rad", "deg", _DEG, _always(0.01), _always(5.0), lambda filed: filed.window.turn_rad,
        "how far each joint that turns may be from the path, so that a stopped program goes on without a return",
        Counts.AT_ONCE, Level.CONFIGURE,
    ),
    Parameter(
        "window_slide", "window_slide_m", "mm", _MM, _always(0.01), _always(20.0), lambda filed: filed.window.slide_m,
        "the same for joints that slide",
        Counts.AT_ONCE, Level.CONFIGURE,
    ),
)  # fmt: skip
"""The register. `cell set`, its answers, the state and docs/commanding.md go by it."""


class NotSet(Exception):
    """A parameter stays as it is; the text says why, for people."""


@dataclass(frozen=True, slots=True)
class _Set:
    value: float
    """In the parameter's unit."""
    by: str
    at: float


class Parameters:
    """Of one robot, from the start of its agent."""

    def __init__(self, robot: str, window: PathWindow, event: Callable[[Severity, str, str, str], None]) -> None:
        """`window` is that of the cell file; `event` notes severity, code, text and remedy."""
        self._robot = robot
        self._window = window
        self._event = event
        self._filed: Filed | None = None
        self._set: dict[str, _Set] = {}
        self.now = AS_FILED

    def declare(self, limits: Limits) -> None:
        """The limits of the robot file, once it is read."""
        self._filed = Filed(limits, self._window)

    @property
    def window(self) -> PathWindow:
        """How far from its path a stopped robot may go on."""
        turn_rad = _given(self.now.window_turn_rad, self._window.turn_rad)
        return PathWindow(turn_rad, _given(self.now.window_slide_m, self._window.slide_m))

    @property
    def manual_speed_m_s(self) -> float:
        return _given(self.now.manual_speed_m_s, MANUAL_SPEED_M_S)

    @property
    def return_speed(self) -> float:
        """Share of the joints' speed limits."""
        return _given(self.now.return_speed, RETURN_SPEED)

    def set(self, name: str, value: float | None, by: str, now: float) -> str:
        """From here on it has this value in its unit, or with None that of the files again; what is to be said.

        Raises `NotSet`.
        """
        parameter, filed = self._known(name)
        if value is not None:
            lowest, highest = parameter.lowest(filed), parameter.highest(filed)
            if not lowest <= value <= highest * (1.0 + 1e-9):
                found = f"{name} of {self._robot}: {value:g} {parameter.unit} found"
                raise NotSet(f"{found}, allowed is {_range(parameter, filed)}; it stays as it is")
        self.now = replace(self.now, **{parameter.field: None if value is None else value * parameter.si})
        self._set.pop(name, None)
        if value is not None:
            self._set[name] = _Set(value, by, now)
        shown = _number(parameter.filed(filed) / parameter.si if value is None else value)
        text = f"{self._robot} has {name} {shown} {parameter.unit}"
        if value is None:
            text += ", as its files say"
        self._event(Severity.INFO, "parameter_set", f"{text}; by {by}", "")
        text += f"; it counts {parameter.counts.value}"
        if value is not None:
            text += f", until `cell set {self._robot} {name} file` or the end of its agent"
        return text

    def _known(self, name: str) -> tuple[Parameter, Filed]:
        parameter = next((each for each in PARAMETERS if each.name == name), None)
        if parameter is None:
            known = near(name, [each.name for each in PARAMETERS], "none")
            lists = f"`cell set {self._robot}` lists what may be set at run time"
            raise NotSet(f"no parameter {name!r}, allowed {known}; {lists}")
        if self._filed is None:
            raise NotSet(f"the file of {self._robot} is not read yet: call again when its gateway has accepted it")
        return parameter, self._filed

    def status(self, now: float) -> dict[str, ParameterStatus]:
        """Those that are set, for everyone."""
        units = {each.name: each.unit for each in PARAMETERS}
        return {
            name: ParameterStatus(each.value, units[name], each.by, max(0.0, now - each.at))
            for name, each in sorted(self._set.items())
        }

    def told(self, now: float) -> str:
        """All of them, one a line: value, range, what it does, when it counts; who has set it."""
        filed = self._filed
        if filed is None:
            return f"the file of {self._robot} is not read yet"
        heading = f"{self._robot}, what may be set at run time: name, value, range, who is meant to, whose value"
        return "\n".join([heading, *(self._line(each, filed, now) for each in PARAMETERS)])

    def _line(self, parameter: Parameter, filed: Filed, now: float) -> str:
        mine = self._set.get(parameter.name)
        value = parameter.filed(filed) / parameter.si if mine is None else mine.value
        origin = "by its files" if mine is None else f"set by {mine.by} {now - mine.at:.0f} s ago"
        shown = f"{_number(value)} {parameter.unit}"
        return (
            f"{parameter.name:18} {shown:>12}  {_range(parameter, filed):24} {parameter.level.value:9} {origin}\n"
            f"{'':18} {parameter.does}; counts {parameter.counts.value}"
        )


def _range(parameter: Parameter, filed: Filed) -> str:
    lowest, highest = (_number(each(filed)) for each in (parameter.lowest, parameter.highest))
    return f"{lowest} to {highest} {parameter.unit}"


def _number(value: float) -> str:
    return f"{value:.6g}"
