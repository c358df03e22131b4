"""Subcommands whose modules are imported when they are asked for: an order need not wait for the kinematics."""

import importlib
from collections.abc import Iterator, Mapping, MutableMapping
from dataclasses import dataclass
from typing import Any

import typer
from typer.core import TyperGroup

HELP = {"help_option_names": ["-h", "--help"]}


def explained(app: typer.Typer) -> Any:
    """The command of `app`, its help as wide as the terminal: the lines of a docstring are the source's alone."""
    command: Any = typer.main.get_command(app)
    for each in (command, *getattr(command, "commands", {}).values()):
        each.help = "\n\n".join(" ".join(part.split()) for part in (each.help or "").split("\n\n"))
    return command


@dataclass(frozen=True, slots=True)
class Place:
    """Where a subcommand is defined, and a line that shows its use."""

    module: str
    """With a dot in front: of `cell.commands`."""
    function: str
    example: str


def subcommands(places: Mapping[str, Place], before: str = "") -> type[TyperGroup]:
    """The `cls` of a `typer.Typer` that has these subcommands, beside those it registers itself.

    Of `places`, by the words of each command, it has those with one word behind the words `before`.
    """

    class Group(TyperGroup):
        def __init__(self, **given: Any) -> None:
            super().__init__(**given)
            words = {name.removeprefix(before): place for name, place in places.items() if name.startswith(before)}
            mine = {word: place for word, place in words.items() if " " not in word}
            self.commands = _Commands(mine, self.commands)

    return Group


class _Commands(MutableMapping[str, Any]):
    """Name to command; what was looked up is kept."""

    def __init__(self, places: dict[str, Place], loaded: Mapping[str, Any]) -> None:
        self._places = places
        self._loaded = dict(loaded)

    def __getitem__(self, name: str) -> Any:
        if name not in self._loaded:
            self._loaded[name] = _load(name, self._places[name])
        return self._loaded[name]

    def __setitem__(self, name: str, command: Any) -> None:
        self._loaded[name] = command

    def __delitem__(self, name: str) -> None:
        del self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._places | self._loaded)

    def __len__(self) -> int:
        return len(self._places | self._loaded)


def _load(name: str, place: Place) -> Any:
    function = getattr(importlib.import_module(place.module, "cell.commands"), place.function)
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, context_settings=HELP)
    app.command(name, epilog=f"Example: {place.example}")(function)
    return explained(app)
