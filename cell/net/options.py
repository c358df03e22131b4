"""From a process' place in the topology and the options of its command line to a Zenoh configuration."""

import json
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
    """The configuration of a session: ours, then what the file of `-c` changes, then `-m -e -l`, then `--cfg`.

    A file's value counts where it differs from Zenoh's own default. Raises `ConfigurationError`.
    """
    config = _parsed("built in", _base(link))
    if options.config is not None:
        try:
            changed = _changes(str(zenoh.Config.from_file(options.config)), str(zenoh.Config()))
        except (zenoh.ZError, OSError) as error:
            raise ConfigurationError(str(options.config), str(error)) from error
        for key, value in changed:
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
        raise ConfigurationError(where, str(error)) from error


def _insert(config: zenoh.Config, where: str, key: str, value: str) -> None:
    try:
        config.insert_json5(key, value)
    except zenoh.ZError as error:
        raise ConfigurationError(where, f"{key}: {error}") from error


def _changes(found: str, default: str) -> list[tuple[str, Any]]:
    """Keys (with slashes) and values that differ between two whole configurations."""

    def walk(path: str, new: Any, old: Any) -> list[tuple[str, Any]]:
        # `connect/retry` and its like can only be set as a whole: Zenoh has no such keys while they are null.
        if isinstance(new, dict) and isinstance(old, dict):
            return [item for key in new for item in walk(f"{path}/{key}" if path else key, new[key], old.get(key))]
        return [(path, new)] if new != old else []

    return walk("", json.loads(found), json.loads(default))
