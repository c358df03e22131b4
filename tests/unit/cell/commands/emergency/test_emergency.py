"""The small path of `cell estop`: what it reads, what it sends, and what cannot keep it from that."""

import json
import subprocess
import sys
import time
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.commands.emergency import stop as course
from cell.commands.emergency.answers import Answers
from cell.commands.emergency.door import Stop
from cell.commands.emergency.recipients import (
    STORED,
    Recipients,
    read_leniently,
    read_strictly,
    recipients_of,
    store,
    stored,
    stored_beside,
)
from cell.commands.emergency.wanted import Wanted, wanted
from cell.commands.emergency.words import LONGEST, operator_name, plain
from cell.config import load_cell_alone
from cell.messages import Estop, Presence, SetEstop
from cell.net.codec import decode, decode_call, encode
from cell.net.keys import Keys
from tests.unit.manager_world import ball
from tests.unit.repository import ROOT

SHIPPED = sorted(ROOT.glob("cell_configs/*/cell.yaml"))
RECIPIENTS = Recipients("two_arms", ("tcp/127.0.0.1:7450", "tcp/[::1]:7451"), ("left", "right"), ("left_bus",), 2.5)


def test_it_imports_no_more_than_zenoh_and_the_standard_library() -> None:
    lines = "import sys; import cell.commands.emergency.stop; print(*sys.modules)"
    imported = subprocess.run(
        [sys.executable, "-c", lines], cwd=ROOT, capture_output=True, text=True, timeout=60, check=True
    ).stdout.split()
    ours = {name for name in imported if name.split(".")[0] in ("cell", "robot_agent", "drive_gateway")}
    allowed = ("cell.commands.emergency", "cell.net.options", "cell.net.errors")
    assert [name for name in ours if name.count(".") > 1 and not name.startswith(allowed)] == []
    assert {"numpy", "pinocchio", "pydantic", "typer", "rich", "ruamel", "ruamel.yaml"} & set(imported) == set()


# What is sent


@given(st.text(), st.text())
def test_its_messages_are_those_of_the_codec(by: str, reason: str) -> None:
    stop = Stop(plain(by), plain(reason))
    message = decode(Estop, stop.message)
    assert message == Estop(message.id, True, plain(by), plain(reason))
    call = decode_call("manager", "estop", stop.call)
    assert call.command == SetEstop(message.id, plain(by), plain(reason))
    assert call.id != message.id


@pytest.mark.parametrize(
    ("given", "read"),
    [
        ("door open", "door open"),
        ("T\udcfcr offen", "Tür offen"),
        ("half a pair \ud800", "half a pair"),
        ("two\nlines\x1b[2J\x00", "two lines [2J"),
        ("", ""),
        ("x" * 10_000, "x" * LONGEST),
    ],
)
def test_any_text_becomes_one_printable_line(given: str, read: str) -> None:
    assert plain(given) == read


def test_a_user_without_a_name_has_a_number(monkeypatch: pytest.MonkeyPatch) -> None:
    for variable in ("LOGNAME", "USER", "LNAME", "USERNAME"):
        monkeypatch.delenv(variable, raising=False)
    monkeypatch.setattr("os.getuid", lambda: 54321)
    assert operator_name().startswith("uid 54321@")
    monkeypatch.setenv("USER", "an\udce4")
    assert operator_name().startswith("anä@")


# The command line


def test_reads_the_options_in_every_form_that_the_other_commands_take(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ZENCELL_FILE", raising=False)
    long = wanted(["--file", "/a.yaml", "--reason", "door open", "--connect", "tcp/b:1", "--state-dir", "/s"])
    assert long == wanted(["-f/a.yaml", "--reason=door open", "-etcp/b:1", "--state-dir=/s"])
    assert (long.file, long.reason, long.endpoints) == (Path("/a.yaml"), "door open", ("tcp/b:1",))
    assert long.state_dir == Path("/s")
    assert wanted([]).file == Path("cell.yaml").absolute()
    monkeypatch.setenv("ZENCELL_FILE", "/c.yaml")
    assert wanted([]).file == Path("/c.yaml")
    assert [wanted(words).file_given for words in ([], ["-f/c.yaml"], ["--file="])] == [False, True, False]


def test_words_that_mean_nothing_are_kept_for_the_end_and_refuse_nothing() -> None:
    asked = wanted(["left", "--raeson", "-f", "/a.yaml", "-x", "--reason"])
    assert asked.ignored == ("left", "--raeson", "-x")
    assert asked.reason == "operator"
    assert asked.file == Path("/a.yaml")


@pytest.mark.parametrize("option", ["--reason=", "--connect=", "--state-dir=", "--file="])
def test_an_empty_value_takes_no_other_word(option: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("ZENCELL_FILE", raising=False)
    asked = wanted([option, "-f", "/a.yaml"])
    assert (asked.file, asked.reason, asked.endpoints, asked.state_dir) == (Path("/a.yaml"), "operator", (), None)
    assert wanted(["-f", "/a.yaml", "--reason", "door open", option]).file == Path("/a.yaml")
    assert wanted(["--file="]).file == Path("cell.yaml").absolute()


def test_an_option_without_its_value_takes_no_other_option_for_it() -> None:
    asked = wanted(["--reason", "-f", "/a.yaml", "-e", "--state-dir", "/s"])
    assert (asked.file, asked.reason, asked.endpoints, asked.state_dir) == (Path("/a.yaml"), "operator", (), Path("/s"))
    assert wanted(["--reason", "-5 V are gone"]).reason == "-5 V are gone"
    assert wanted(["--reason", "-fire", "-f", "/a.yaml"]).reason == "-fire"


# Whom it must reach


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.parent.name)
def test_reads_leniently_what_the_schema_reads(file: Path) -> None:
    settings = load_cell_alone(file)
    whole, found = recipients_of(settings), read_leniently(file)
    assert (found.cell, sorted(found.endpoints)) == (whole.cell, sorted(whole.endpoints))
    assert read_strictly(file) == whole
    assert whole.estop_delay_s == settings.times.estop_delay_s


@pytest.mark.parametrize(
    "text",
    [
        "cell: a\nmanager: {endpoint: tcp/h:1}\nwhat: is this\n",
        "cell: 'a'  # name\nmanager:\n  endpoint: \"tcp/h:1\"\n# endpoint: tcp/old:1\nrobots: [\n\x00",
        "{cell: a, manager: {endpoint: tcp/h:1}}",
        '{"cell": "a", "manager": {"endpoint": "tcp/h:1"}}',
        "cell: a\r\nmanager: {endpoint: tcp/h:1}\r\nname: \udce4\r\n",
        'cell: &c "a"\nmanager: {endpoint: &m "tcp/h:1"}\nrobots: [\n',
        "cell: !!str a\nmanager:\n  endpoint: !!str &m tcp/h:1\nrobots: [\n",
        "cell: a\nhere: &m tcp/h:1\nmanager: {endpoint: *m}\nrobots: [\n",
        "cell: a\nmanager:\n  endpoint: >-\n    tcp/h:1\nrobots: [\n",
        'cell: a\nmanager: {note: "door # 3", endpoint: "tcp/h:1"}\n',
        "cell: a\nmanager: {note: 'it''s # 3', endpoint: 'tcp/h:1'}  # endpoint: tcp/old:1\n",
        'cell: a\nmanager: {note: "a \\" # 3", endpoint: tcp/h:1}\n',
        'cell: a\nmanager: {note: "door\n  # 3", endpoint: tcp/h:1}\n',
        "cell: a\nnote: it's a 3' door # endpoint: tcp/old:1\nmanager: {endpoint: tcp/h:1}\n",
    ],
)
def test_reads_name_and_endpoints_whatever_else_is_broken(tmp_path: Path, text: str) -> None:
    file = tmp_path / "cell.yaml"
    file.write_bytes(text.encode("utf-8", "surrogateescape"))
    assert read_leniently(file) == Recipients("a", ("tcp/h:1",))


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("cell: two-arms\n", "two-arms"),
        ("cell: 'two arms'  # the line\n", "two arms"),
        ("cell: two arms # the line\r\n", "two arms"),
        ("{cell: two.arms, manager: x}", "two.arms"),
        ('{"cell": "two"}', "two"),
        ("cell: two/arms\n", ""),
        ("cell: two*\n", ""),
        ("cell: [\n", ""),
        ("cell:\n", ""),
    ],
)
def test_a_name_is_read_to_its_end_or_not_at_all(tmp_path: Path, text: str, name: str) -> None:
    file = tmp_path / "cell.yaml"
    file.write_text(text)
    assert read_leniently(file).cell == name


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32"])
def test_reads_name_and_endpoints_in_whatever_encoding(tmp_path: Path, encoding: str) -> None:
    file = tmp_path / "cell.yaml"
    file.write_bytes("cell: a\nmanager: {endpoint: tcp/h:1}\nname: Tür\n".encode(encoding))
    assert read_leniently(file) == Recipients("a", ("tcp/h:1",))


@pytest.mark.parametrize("part", ["\n", ' "a', " #", " ' # '", '"\\', "\ncell:", "&a ", "endpoint:"])
def test_no_text_keeps_the_stop_back(tmp_path: Path, part: str) -> None:
    file = tmp_path / "cell.yaml"
    file.write_text(part * (1_000_000 // len(part)))
    began = time.process_time()
    read_leniently(file)
    assert time.process_time() - began < 2.0


def test_a_file_that_cannot_be_read_says_nothing(tmp_path: Path) -> None:
    for file in (tmp_path, tmp_path / "missing", Path("/dev/zero"), Path("a\0b")):
        assert read_leniently(file) == Recipients("", ())
        assert read_strictly(file) is None


def test_what_a_process_stored_is_read_again(tmp_path: Path) -> None:
    store(tmp_path, RECIPIENTS)
    store(tmp_path, RECIPIENTS)
    assert stored(tmp_path) == RECIPIENTS
    assert [file.name for file in tmp_path.iterdir()] == [STORED]


def damaged(**changes: object) -> str:
    return json.dumps(asdict(RECIPIENTS) | changes)


DAMAGED = [
    "",
    "{",
    "[]",
    "null",
    '{"cell": 1}',
    json.dumps({"cell": "a", "endpoints": 3}),
    "[" * 100_000,
    damaged(estop_delay_s=10**400),
    damaged(estop_delay_s=float("inf")),
    damaged(estop_delay_s=float("nan")),
    damaged(estop_delay_s=-1.0),
    damaged(cell="a*"),
    damaged(cell=""),
    damaged(endpoints="tcp/h:1"),
    damaged(robots=[["left"]]),
]


@pytest.mark.parametrize("text", DAMAGED, ids=lambda text: text[:20])
def test_a_stored_file_that_is_broken_is_left_aside_and_the_others_count(tmp_path: Path, text: str) -> None:
    for name in ("aa", RECIPIENTS.cell, "zz"):
        (tmp_path / ".zencell" / name).mkdir(parents=True)
        (tmp_path / ".zencell" / name / STORED).write_text(text)
    store(tmp_path / ".zencell" / RECIPIENTS.cell, RECIPIENTS)
    assert stored(tmp_path / ".zencell" / "zz") is None
    assert stored_beside(tmp_path / "cell.yaml", None, Recipients("", ())) == [RECIPIENTS]


def test_what_is_stored_beside_a_broken_cell_file_stands_in_for_it(tmp_path: Path) -> None:
    file = tmp_path / "cell.yaml"
    other = Recipients("other", ("tcp/other:1",))
    for each in (RECIPIENTS, other):
        folder = tmp_path / ".zencell" / each.cell
        folder.mkdir(parents=True)
        store(folder, each)
    assert stored_beside(file, None, Recipients("", ())) == [other, RECIPIENTS]
    assert stored_beside(file, None, Recipients("two_arms", ())) == [RECIPIENTS]
    assert stored_beside(file, None, Recipients("two_arms", ("tcp/127.0.0.1:9",))) == [RECIPIENTS]
    assert stored_beside(file, None, Recipients("renamed", RECIPIENTS.endpoints)) == [RECIPIENTS]
    assert stored_beside(file, tmp_path / ".zencell" / "other", Recipients("", ())) == [other]
    assert stored_beside(tmp_path / "nowhere" / "cell.yaml", None, Recipients("", ())) == []


def test_a_cell_file_that_was_not_named_says_nothing_of_the_doors_that_were() -> None:
    door = "tcp/elsewhere:1"
    own = [(endpoint, (RECIPIENTS.cell,)) for endpoint in RECIPIENTS.endpoints]
    asked = Wanted(Path("cell.yaml"), endpoints=(door, RECIPIENTS.endpoints[0]))
    assert course._ways(asked, RECIPIENTS, [RECIPIENTS]) == [(door, ()), (RECIPIENTS.endpoints[0], ()), *own]
    asked = replace(asked, file_given=True)
    assert course._ways(asked, RECIPIENTS, [RECIPIENTS]) == [(door, (RECIPIENTS.cell,)), *own]


# Who has confirmed


def test_reads_who_stands_from_what_robots_publish() -> None:
    stands = Presence("left", "b", 1, 1, None, "d", ball(0.0), 0.0, estop_acknowledged="e1")
    answers, keys = Answers(), Keys("line")
    for message in (stands, replace(stands, robot="right", estop_acknowledged=None)):
        sample: Any = SimpleNamespace(
            key_expr=keys.of(message), payload=SimpleNamespace(to_bytes=partial(encode, message))
        )
        answers.state(sample)
    assert answers.standing() == {("line", "robot", "left")}


@pytest.mark.parametrize(
    "data", [b"[" * 100_000, b"ZPR3", b"\xff", b'{"estop_acknowledged":' + b"9" * 5000 + b"}", b"3"]
)
def test_whatever_others_publish_is_no_more_than_left_aside(data: bytes) -> None:
    stands = Presence("left", "b", 1, 1, None, "d", ball(0.0), 0.0, estop_acknowledged="e1")
    answers, keys = Answers(), Keys("line")
    for key, payload in (("cell/line/robot/x/presence", data), (keys.of(stands), encode(stands))):
        sample: Any = SimpleNamespace(key_expr=key, payload=SimpleNamespace(to_bytes=partial(bytes, payload)))
        answers.state(sample)
    assert answers.standing() == {("line", "robot", "left")}


@pytest.mark.parametrize("data", [b"[" * 100_000, b"\xff", b'{"ok": true, "text": {}}'])
def test_whatever_a_stranger_replies_as_the_manager_does_not_latch(data: bytes) -> None:
    answers = Answers()
    answers.asked()
    said = SimpleNamespace(payload=SimpleNamespace(to_bytes=partial(bytes, data)))
    for reply in (SimpleNamespace(ok=said), SimpleNamespace(ok=None, err=said)):
        answers.reply(cast("Any", reply))
    answers.no_more()
    assert not answers.latched
    assert answers.manager is not None


class FewAnswers(Answers):
    """One look after the other, as it is heard."""

    def __init__(self, *looks: set[tuple[str, str, str]]) -> None:
        super().__init__()
        self._looks = list(looks)

    @property
    def manager(self) -> tuple[bool, str] | None:
        return True, "the emergency stop is set"

    def standing(self) -> set[tuple[str, str, str]]:
        return self._looks.pop(0) if self._looks else set()


def test_waits_for_everyone_of_the_cell_and_names_them_as_they_confirm(capsys: pytest.CaptureFixture[str]) -> None:
    cell = "two_arms"
    answers = FewAnswers(set(), {(cell, "robot", "left")}, {(cell, "robot", "right"), (cell, "gateway", "left_bus")})
    assert course._tell_who_stands(answers, [RECIPIENTS], [], set()) == []
    told = capsys.readouterr().out.splitlines()
    assert told == [
        "manager: the emergency stop is set",
        "confirmed: robot left",
        "confirmed: gateway left_bus",
        "confirmed: robot right",
    ]


def test_waits_as_long_as_the_cells_own_delay_and_then_names_who_has_not_confirmed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(course, "STANDSTILL_S", 0.05)
    monkeypatch.setattr(course, "NEWS_S", 0.0)
    cell = Recipients("c", (), ("left", "right"), (), 0.05)
    confirmed = FewAnswers({("c", "robot", "left")})
    assert course._tell_who_stands(confirmed, [cell], [], set()) == ["robot right"]
    assert "waiting up to 0 s for: robot right" in capsys.readouterr().out
