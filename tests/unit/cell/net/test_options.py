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


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (
            "zenoh.json5",
            """// what Zenoh does by itself
            {scouting:{multicast:{enabled:true,/* see: above */},\t'gossip': {"enabled":true}},
             transport: {link: {tx: {lease: 10000, }}}}""",
        ),
        (
            "zenoh.yaml",
            "scouting:\n  multicast: {enabled: true}\n  gossip: {enabled: true}\n"
            "transport: {link: {tx: {lease: 10000}}}\n",
        ),
    ],
)
def test_a_file_may_name_what_is_zenohs_own_default(tmp_path: Path, name: str, text: str) -> None:
    file = tmp_path / name
    file.write_text(text)
    gateway = Link("peer", listen=("tcp/127.0.0.1:7461",))
    options = ZenohOptions(config=file)
    assert value(options, "scouting/multicast/enabled", gateway) is True
    assert value(options, "scouting/gossip/enabled", gateway) is True
    assert value(options, "transport/link/tx/lease", gateway) == 10_000
    assert value(options, "listen/endpoints", gateway) == list(gateway.listen)
    assert value(options, "scouting/delay", gateway) == 0


def test_what_can_only_be_set_as_a_whole_is(tmp_path: Path) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text("{ connect: { retry: { period_init_ms: 70 } } }")
    retry = value(ZenohOptions(config=file), "connect/retry")
    assert isinstance(retry, dict)
    assert retry["period_init_ms"] == 70


def test_an_empty_file_changes_nothing(tmp_path: Path) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text("{ /* nothing */ }")
    assert str(zenoh_config(AGENT, ZenohOptions(config=file))) == str(zenoh_config(AGENT, ZenohOptions()))


@pytest.mark.parametrize("where", ["built in", "-e"])
def test_an_endpoint_that_is_none_is_named_without_a_path_of_the_compiler(where: str) -> None:
    wrong = ("nonsense",)
    link, options = (
        (Link("client", connect=wrong), ZenohOptions()) if where == "built in" else (AGENT, ZenohOptions(connect=wrong))
    )
    with pytest.raises(ConfigurationError) as refused:
        zenoh_config(link, options)
    assert "<protocol>/<address>" in str(refused.value)
    assert "nonsense" in str(refused.value)
    assert "cargo" not in str(refused.value)


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
