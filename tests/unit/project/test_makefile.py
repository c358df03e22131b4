"""What `make` says on a machine on which it cannot set the project up."""

import subprocess
from pathlib import Path

import pytest

from tests.unit.repository import ROOT

TOO_OLD = """#!/bin/sh
case "$*" in
  --version) echo "Python 3.8.10" ;;
  *version_info*) exit 1 ;;
esac
"""
WITHOUT_VENV = """#!/bin/sh
case "$*" in
  --version) echo "Python 3.12.1" ;;
  *venv*) exit 1 ;;
esac
"""


def make(target: str, python: Path, tmp_path: Path) -> subprocess.CompletedProcess[str]:
    command = ["make", "--no-print-directory", target, f"PYTHON={python}", f"VENV={tmp_path / 'venv'}"]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=30, check=False)


@pytest.mark.parametrize("target", ["demo", "test"])
@pytest.mark.parametrize(
    ("script", "said"),
    [
        (None, "no Python found"),
        (TOO_OLD, "found Python 3.8.10"),
        (WITHOUT_VENV, "Python 3.12.1 lacks the modules venv and ensurepip"),
    ],
    ids=["no python", "old python", "no venv module"],
)
def test_one_line_says_what_is_missing(target: str, script: str | None, said: str, tmp_path: Path) -> None:
    python = tmp_path / "python"
    if script is not None:
        python.write_text(script)
        python.chmod(0o755)
    result = make(target, python, tmp_path)
    lines = [line for line in result.stderr.splitlines() if line.startswith("zencell: ")]
    assert result.returncode != 0
    assert len(lines) == 1
    assert said in lines[0]
