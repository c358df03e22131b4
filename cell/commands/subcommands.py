"""Subcommands whose modules are imported when they are asked for: an order need not wait for the kinematics."""

import importlib
import re
from collections.abc import Iterator, Mapping, MutableMapping
from dataclasses import dataclass
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from cell.commands.access import require
from cell.view.gate import Level

HELP = {"help_option_names": ["-h", "--help"]}
_BELOW_ZERO = re.compile(r"-\.?\d.*")


def explained(app: typer.Typer) -> Any:
    """The command of `app`, its help as wide as the terminal: the lines of a docstring are the source's alone."""
    command: Any = typer.main.get_command(app)
    for each in (command, *getattr(command, "commands", {}).values()):
        each.help = "\n\n".join(" ".join(part.split()) for part in (each.help or "").split("\n\n"))
    return command


@dataclass(frozen=True, slots=True)
class Subcommand:
    """Where a subcommand is defined, and a line that shows its use."""

    module: str
    """With a dot in front: of `cell.commands`."""
    function: str
    example: str
    level: Level = Level.OPERATE
    """Of the account that asks for it."""


def subcommands(definitions: Mapping[str, Subcommand], before: str = "") -> type[TyperGroup]:
    """The `cls` of a `typer.Typer` that has these subcommands, beside those it registers itself.

    Of `definitions`, by the words of each command, it has those with one word after the words `before`.
    """

    class Group(TyperGroup):
        def __init__(self, **given: Any) -> None:
            super().__init__(**given)
            words = {
                name.removeprefix(before): definition
                for name, definition in definitions.items()
                if name.startswith(before)
            }
            mine = {word: definition for word, definition in words.items() if " " not in word}
            self.commands = _Commands(mine, self.commands)

    return Group


class _Command(TyperCommand):
    """Takes a number below 0 as a number; other parsers take it for an option: `cell override left -30`."""

    level = Level.OPERATE

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        ctx.ignore_unknown_options = any(_BELOW_ZERO.fullmatch(word) for word in args)
        return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        require(self.level, ctx.command_path)
        return super().invoke(ctx)


class _Commands(MutableMapping[str, Any]):
    """Name to command; what was looked up is kept."""

    def __init__(self, definitions: dict[str, Subcommand], loaded: Mapping[str, Any]) -> None:
        self._definitions = definitions
        self._loaded = dict(loaded)

    def __getitem__(self, name: str) -> Any:
        if name not in self._loaded:
            self._loaded[name] = _load(name, self._definitions[name])
        return self._loaded[name]

    def __setitem__(self, name: str, command: Any) -> None:
        self._loaded[name] = command

    def __delitem__(self, name: str) -> None:
        del self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._definitions | self._loaded)

    def __len__(self) -> int:
        return len(self._definitions | self._loaded)


def _load(name: str, definition: Subcommand) -> Any:
    function = getattr(importlib.import_module(definition.module, "cell.commands"), definition.function)
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, context_settings=HELP)
    app.command(name, cls=_Command, epilog=f"Example: {definition.example}")(function)
    command = explained(app)
    command.level = definition.level
    return command
