"""What the robot carries, tool and part: by its program, or by an operator's word.

Nothing measures it and nothing stores it. After the agent's start nobody knows which part it holds, nor which tool is
mounted where its program changes tools, and the body has all of them until an operator says which one is there: they
may have been changed meanwhile. A program that changes no tool has the one of the robot file.
"""

from dataclasses import replace

from robot_agent.model.description import NOTHING, Mounted, RobotDescription


class MountedNow:
    """One tool and one part at most, while they are known."""

    def __init__(self) -> None:
        self.present = NOTHING
        """All that it may carry."""
        self.tools: tuple[str, ...] | None = None
        """Names of all tools; None before the robot file is read."""
        self.parts: tuple[str, ...] = ()
        """Names of all parts."""
        self._tool_known = self._part_known = True

    def declare(self, described: RobotDescription, *, changes_tools: bool) -> None:
        """The tools and parts of the robot file, once it is read; whether the program changes tools."""
        if self.tools is not None:
            return
        self.tools, self.parts = tuple(described.tools), tuple(described.parts)
        self._tool_known = not (changes_tools and self.tools)
        self._part_known = not self.parts
        self.present = Mounted(described.mounted.tools if self._tool_known else self.tools, self.parts)

    def follow(self, other: "MountedNow") -> None:
        """All that is known there."""
        self.present, self.tools, self.parts = other.present, other.tools, other.parts
        self._tool_known, self._part_known = other._tool_known, other._part_known

    def take(self, mounted: Mounted) -> None:
        """From here on it carries this, by a program, which runs only where all that it changes is known."""
        self.present = mounted

    def say_tool(self, tool: str | None) -> None:
        """An operator has looked: this tool is mounted, or none."""
        self.present = replace(self.present, tools=() if tool is None else (tool,))
        self._tool_known = True

    def say_part(self, part: str | None) -> None:
        """An operator has looked: it holds this part, or none."""
        self.present = replace(self.present, parts=() if part is None else (part,))
        self._part_known = True

    @property
    def tool(self) -> str | None:
        """The name of the mounted tool, empty for none; None where nobody knows."""
        return "".join(self.present.tools) if self._tool_known else None

    @property
    def part(self) -> str | None:
        """The name of the part, empty for none; None where nobody knows."""
        return "".join(self.present.parts) if self._part_known else None
