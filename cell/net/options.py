"""From a process' place in the topology and the options of its command line to a Zenoh configuration."""

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import zenoh

from cell.net.errors import ConfigurationError


@dataclass(frozen=True, slots=True)
class Link:
    """A process' place in the topology (`docs/architecture.md`, section 3)."""

    mode: str
    """`"peer"` or `"client"`."""
    listen: tuple[str, ...] = ()
    connect: tuple[str, ...] = ()
    gossip: bool = False
    open_timeout_s: float = 1.0
    """How long a client waits for its endpoint. A peer opens at once and connects in the background."""


@dataclass(frozen=True, slots=True)
class ZenohOptions:
    """The options that Zenoh's own tools share: `-m`, `-e`, `-l`, `-c` and `--cfg`."""

    mode: str | None = None
    connect: tuple[str, ...] = ()
    listen: tuple[str, ...] = ()
    config: Path | None = None
    settings: tuple[str, ...] = ()
    """Each `KEY:VALUE`, the key with slashes, the value as JSON5."""


def effective_link(link: Link, options: ZenohOptions) -> Link:
    """`link` with what `-m`, `-e` and `-l` replace."""
    return Link(
        options.mode or link.mode,
        options.listen or link.listen,
        options.connect or link.connect,
        link.gossip,
        link.open_timeout_s,
    )


def zenoh_config(link: Link, options: ZenohOptions) -> zenoh.Config:
    """The configuration of a session: ours, then what the file of `-c` names, then `-m -e -l`, then `--cfg`.

    Raises `ConfigurationError`.
    """
    config = _parsed(", ".join((*link.listen, *link.connect)) or "built in", _base(link))
    if options.config is not None:
        for key, value in _named(options.config):
            _insert(config, str(options.config), key, json.dumps(value))
    if options.mode:
        _insert(config, "-m", "mode", json.dumps(options.mode))
    if options.connect:
        _insert(config, "-e", "connect/endpoints", json.dumps(options.connect))
    if options.listen:
        _insert(config, "-l", "listen/endpoints", json.dumps(options.listen))
    for setting in options.settings:
        key, colon, value = setting.partition(":")
        if not colon:
            raise ConfigurationError("--cfg", f"expected KEY:VALUE, found {setting!r}")
        _insert(config, "--cfg", key, value)
    return config


def _base(link: Link) -> dict[str, Any]:
    """No discovery but the named endpoints; a short lease, because late control data are worse than lost ones."""
    timeout_ms = round(link.open_timeout_s * 1000) if link.mode == "client" else -1
    return {
        "mode": link.mode,
        "listen": {"endpoints": list(link.listen)},
        "connect": {
            "endpoints": list(link.connect),
            "timeout_ms": timeout_ms,
            "exit_on_failure": link.mode == "client",
            "retry": {"period_init_ms": 50, "period_max_ms": 250, "period_increase_factor": 2},
        },
        "scouting": {"delay": 0, "multicast": {"enabled": False}, "gossip": {"enabled": link.gossip}},
        "timestamping": {"enabled": False},
        "transport": {"link": {"tx": {"lease": 500, "keep_alive": 4}}, "shared_memory": {"enabled": False}},
    }


def _parsed(where: str, values: dict[str, Any]) -> zenoh.Config:
    try:
        return zenoh.Config.from_json5(json.dumps(values))
    except zenoh.ZError as error:
        raise ConfigurationError(where, _reason(error)) from error


def _insert(config: zenoh.Config, where: str, key: str, value: str) -> None:
    try:
        config.insert_json5(key, value)
    except zenoh.ZError as error:
        raise ConfigurationError(where, f"{key}: {_reason(error)}") from error


def _reason(error: Exception) -> str:
    """What Zenoh says, without the place in its sources."""
    return str(error).split(" at /")[0]


def _named(file: Path) -> list[tuple[str, Any]]:
    """The keys (with slashes) that a Zenoh configuration file names, with the values that Zenoh reads there."""
    try:
        whole = json.loads(str(zenoh.Config.from_file(file)))
        text = file.read_text(encoding="utf-8")
    except (zenoh.ZError, OSError, ValueError) as error:
        raise ConfigurationError(str(file), _reason(error)) from error
    default = json.loads(str(zenoh.Config()))

    def walk(path: str, named: Any, values: Any, default: Any) -> list[tuple[str, Any]]:
        # `connect/retry` and its like can only be set as a whole: Zenoh has no such keys while they are null.
        if not all(isinstance(part, dict) for part in (named, values, default)):
            return [(path, values)]
        return [
            item
            for key in named
            if key in values
            for item in walk(f"{path}/{key}" if path else key, named[key], values[key], default.get(key))
        ]

    return walk("", _raw(file, text) or {}, whole, default)


_JSON5 = re.compile(r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])*\'|//[^\n]*|/\*.*?\*/|[:\t]', re.DOTALL)


def _raw(file: Path, text: str) -> Any:
    """What stands in a file that Zenoh has read, for the sake of its keys: YAML, or JSON5 as a flow of YAML."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import YAMLError

    def as_yaml(part: re.Match[str]) -> str:
        return {":": ": ", "\t": " "}.get(part[0], " " if part[0].startswith("/") else part[0])

    try:
        return YAML(typ="safe", pure=True).load(text if file.suffix in (".yaml", ".yml") else _JSON5.sub(as_yaml, text))
    except YAMLError as error:
        raise ConfigurationError(str(file), f"its keys cannot be read: {error}") from error
