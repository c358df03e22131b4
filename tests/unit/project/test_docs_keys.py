"""The pages with the keys of a file are those that `cell schema --keys` prints."""

import pytest

from cell.commands.files.schema import KEYS, Subject, keys_of
from tests.unit.repository import ROOT


@pytest.mark.parametrize("subject", KEYS, ids=lambda subject: subject.value)
def test_the_page_of_a_file_says_what_its_schema_says(subject: Subject) -> None:
    page = ROOT / "docs" / f"{subject.value}_file.md"
    assert page.read_text() == keys_of(subject), f"cell schema {subject.value} --keys > {page.relative_to(ROOT)}"
