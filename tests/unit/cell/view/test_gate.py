"""Who is let in by the gate of the page."""

import http

import pytest

from cell.view.control import Control, Visitor
from cell.view.gate import Entered, Gate, Level, NoEntry

HOST = "127.0.0.1:8080"
NAMES = ("127.0.0.1", "localhost", "::1")


def entered(gate: Gate, level: Level, host: str = HOST) -> dict[str, str]:
    """The headers of a browser that has opened the printed address."""
    found = gate.judge(f"/?token={gate.tokens[level]}", {"host": host}, False)
    assert isinstance(found, Entered)
    return {"host": host, "cookie": found.cookie.split(";")[0]}


@pytest.fixture
def gate() -> Gate:
    return Gate(NAMES, Level.CONFIGURE)


@pytest.mark.parametrize("level", Level)
@pytest.mark.parametrize("host", [HOST, "localhost:8080", "[::1]:8080", "localhost"])
def test_the_printed_address_leads_to_its_level(gate: Gate, level: Level, host: str) -> None:
    headers = entered(gate, level, host)
    assert gate.judge("/", headers, False) is level
    assert gate.judge("/", {**headers, "origin": f"http://{host}"}, True) is level


def test_the_cookie_is_for_this_site_alone_and_no_script_reads_it(gate: Gate) -> None:
    found = gate.judge(f"/?token={gate.tokens[Level.WATCH]}", {"host": HOST}, False)
    assert isinstance(found, Entered)
    assert "HttpOnly" in found.cookie
    assert "SameSite=Strict" in found.cookie


def test_without_a_token_there_is_nothing(gate: Gate) -> None:
    for path in ("/", "/?token=", "/?token=guess", "/index.html", "/?token=%ff%fe"):
        found = gate.judge(path, {"host": HOST}, False)
        assert isinstance(found, NoEntry)
        assert found.status == http.HTTPStatus.UNAUTHORIZED
        assert "whole address" in found.text


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://127.0.0.1:9999", "http://localhost:8080", "", "file://"]
)
@pytest.mark.parametrize("websocket", [True, False])
def test_a_page_of_another_origin_gets_nothing_though_it_has_the_cookie(
    gate: Gate, origin: str, websocket: bool
) -> None:
    headers = {**entered(gate, Level.OPERATE), "origin": origin}
    assert isinstance(gate.judge("/", headers, websocket), NoEntry)


def test_a_websocket_that_names_no_origin_gets_nothing(gate: Gate) -> None:
    assert isinstance(gate.judge("/", entered(gate, Level.OPERATE), True), NoEntry)


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8080", "", "127.0.0.1.evil.example", "[::2]", "["])
def test_a_foreign_name_that_leads_here_gets_nothing(gate: Gate, host: str) -> None:
    headers = {**entered(gate, Level.OPERATE), "host": host, "origin": f"http://{host}"}
    assert isinstance(gate.judge("/", headers, True), NoEntry)


def test_levels_above_the_highest_have_no_token() -> None:
    assert set(Gate(NAMES, Level.WATCH).tokens) == {Level.WATCH}
    assert set(Gate(NAMES, Level.OPERATE).tokens) == {Level.WATCH, Level.OPERATE}


def test_tokens_are_new_in_each_run() -> None:
    assert Gate(NAMES, Level.WATCH).tokens != Gate(NAMES, Level.WATCH).tokens


def test_one_browser_has_control_until_another_takes_it_on_purpose() -> None:
    control, one, other = Control(), Visitor(1, "a", Level.OPERATE), Visitor(2, "b", Level.CONFIGURE)
    assert not control.may(one)
    assert control.take(one) is None
    assert control.may(one)
    assert not control.may(other)
    assert control.take(other) == one
    assert not control.may(one)
    assert control.may(other, Level.CONFIGURE)


def test_a_browser_that_goes_gives_back_its_own_control_and_no_other() -> None:
    control, one, other = Control(), Visitor(1, "a", Level.OPERATE), Visitor(2, "b", Level.OPERATE)
    control.take(one)
    control.leave(other)
    assert control.holder == one
    control.leave(one)
    assert control.holder is None


def test_who_may_only_watch_takes_nothing_and_who_operates_does_not_configure() -> None:
    control = Control()
    with pytest.raises(PermissionError, match="only watch"):
        control.take(Visitor(1, "a", Level.WATCH))
    operator = Visitor(2, "b", Level.OPERATE)
    control.take(operator)
    assert not control.may(operator, Level.CONFIGURE)
