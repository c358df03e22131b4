"""`docs/messages.md` says what the code says."""

import dataclasses
import re

import pytest

from cell.messages import COMMANDS, STATES
from cell.net import binary
from tests.unit.repository import ROOT

DOCS = ROOT / "docs" / "messages.md"
BINARY = {"SetpointBlock", "DriveFeedback"}
"""Without a field that is JSON."""


@pytest.mark.parametrize("kind", [kind for kind in STATES if kind.__name__ not in BINARY], ids=lambda k: k.__name__)
def test_names_every_field_of_a_json_message(kind: type) -> None:
    section = DOCS.read_text().split(f"\n## {kind.__name__}\n")[1].split("\n## ")[0]
    missing = [f.name for f in dataclasses.fields(kind) if f"`{f.name}`" not in section]
    assert missing == []


@pytest.mark.parametrize("kind", STATES, ids=lambda k: k.__name__)
def test_the_table_of_keys_has_every_message_on_its_key(kind: type) -> None:
    rows = re.findall(r"^\| `(.*)` \| (\w+)", DOCS.read_text(), re.M)
    (key,) = [key for key, name in rows if name == kind.__name__]
    assert re.sub("<.*?>", "{}", key) == re.sub("{.*?}", "{}", STATES[kind].key)


def test_shows_the_byte_layouts_of_the_codec() -> None:
    rows = [line for line in (binary.__doc__ or "").splitlines() if line.startswith("|")]
    assert [row for row in rows if row not in DOCS.read_text()] == []


def test_names_every_verb() -> None:
    section = DOCS.read_text().split("\n## Call and Reply\n")[1].split("\n## ")[0]
    assert [verb for verbs in COMMANDS.values() for verb in verbs if verb not in section] == []
