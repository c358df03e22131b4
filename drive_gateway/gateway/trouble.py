"""A reason to stop a robot, with its address."""

from dataclasses import dataclass

HARD_WIRED = "use the hard-wired emergency stop now and keep everybody away"
"""What is left to do where software cannot stop a drive."""


@dataclass(frozen=True, slots=True)
class Trouble:
    """What went wrong: a stable code, what was found and where, what to do next, and the node it is about."""

    code: str
    text: str
    remedy: str
    node_id: int | None = None
    emergency_code: int | None = None
