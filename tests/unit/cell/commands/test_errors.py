"""What the user sees when a command fails."""

from pathlib import Path

import pytest

from cell.commands.errors import CommandError, keep_tracebacks_in, run_app


def test_a_refusal_says_what_and_what_next(capsys: pytest.CaptureFixture[str]) -> None:
    def app() -> None:
        raise CommandError("no robot 'lift'", "name one of: left, right")

    with pytest.raises(SystemExit) as exit_:
        run_app(app, "cell")
    assert exit_.value.code == 1
    assert capsys.readouterr().err == "cell: no robot 'lift'\n  next: name one of: left, right\n"


def test_an_internal_error_goes_to_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def app() -> None:
        raise ZeroDivisionError("our mistake")

    keep_tracebacks_in(tmp_path)
    with pytest.raises(SystemExit) as exit_:
        run_app(app, "cell")
    log = tmp_path / "internal-error-cell.log"
    assert exit_.value.code == 1
    assert "Traceback" in log.read_text()
    error = capsys.readouterr().err
    assert str(log) in error
    assert "Traceback" not in error


def test_an_internal_error_is_said_even_where_no_file_can_be_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def app() -> None:
        raise ZeroDivisionError("our mistake")

    keep_tracebacks_in(tmp_path / "missing")
    with pytest.raises(SystemExit):
        run_app(app, "cell")
    assert "internal error, please report it: ZeroDivisionError('our mistake')" in capsys.readouterr().err
