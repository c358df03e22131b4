"""The options of Zenoh's own tools, over the configuration of a process' place in the cell."""

import json
from pathlib import Path

import pytest

from cell.net.errors import ConfigurationError
from cell.net.options import Link, ZenohOptions, zenoh_config

AGENT = Link("peer", connect=("tcp/127.0.0.1:7450", "tcp/127.0.0.1:7461"), gossip=True)


def value(options: ZenohOptions, key: str, link: Link = AGENT) -> object:
    return json.loads(zenoh_config(link, options).get_json(key))


def test_without_options_only_the_named_endpoints_are_used() -> None:
    plain = ZenohOptions()
    assert value(plain, "connect/endpoints") == list(AGENT.connect)
    assert value(plain, "listen/endpoints") == []
    assert value(plain, "scouting/multicast/enabled") is False
    assert value(plain, "scouting/gossip/enabled") is True
    assert value(plain, "transport/link/tx/lease") == 500
    assert value(plain, "transport/shared_memory/enabled") is False


def test_mode_connect_and_listen_replace_their_part() -> None:
    options = ZenohOptions(mode="client", connect=("tcp/10.0.0.1:7",), listen=("tcp/10.0.0.2:8",))
    assert value(options, "mode") == "client"
    assert value(options, "connect/endpoints") == ["tcp/10.0.0.1:7"]
    assert value(options, "listen/endpoints") == ["tcp/10.0.0.2:8"]


def test_a_file_changes_what_it_names_and_nothing_else(tmp_path: Path) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text('{ transport: { link: { tx: { lease: 700 } } }, connect: { endpoints: ["tcp/10.0.0.3:9"] } }')
    options = ZenohOptions(config=file)
    assert value(options, "transport/link/tx/lease") == 700
    assert value(options, "transport/link/tx/keep_alive") == 4
    assert value(options, "connect/endpoints") == ["tcp/10.0.0.3:9"]
    assert value(options, "scouting/multicast/enabled") is False


def test_a_setting_wins_over_everything(tmp_path: Path) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text("{ transport: { link: { tx: { lease: 700 } } } }")
    assert value(ZenohOptions(config=file, settings=("transport/link/tx/lease:800",)), "transport/link/tx/lease") == 800


@pytest.mark.parametrize(
    ("options", "where"),
    [
        (ZenohOptions(settings=("lease=5",)), "expected KEY:VALUE, found 'lease=5'"),
        (ZenohOptions(settings=("no/such/key:5",)), "no/such/key"),
        (ZenohOptions(config=Path("no_such_file.json5")), "no_such_file.json5"),
        (ZenohOptions(mode="boss"), "mode"),
    ],
)
def test_what_zenoh_refuses_is_named(options: ZenohOptions, where: str) -> None:
    with pytest.raises(ConfigurationError, match=where):
        zenoh_config(AGENT, options)
