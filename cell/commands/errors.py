"""How a command ends when something is wrong: a few lines on stderr that say what, where and what to do next."""

import shlex
import sys
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path

from cell.config import ConfigError
from cell.manager.journal import JournalError
from cell.net.errors import NetError
from drive_gateway.errors import GatewayError


class CommandError(Exception):
    """A command cannot do what it was asked for.

    `what` says what was found and where, and what is allowed; `next_step` what the user can do about it.
    """

    def __init__(self, what: str, next_step: str = "", exit_code: int = 1) -> None:
        super().__init__(what)
        self.what = what
        self.next_step = next_step
        self.exit_code = exit_code


def not_installed(what: str, group: str, error: ImportError) -> CommandError:
    """An optional group of packages is missing."""
    return CommandError(
        f"{what} needs packages that are not installed: {error.name or error}",
        f"install them: pip install 'zencell[{group}]'",
    )


def quoted(file: Path) -> str:
    """A file's name as a shell takes it, for the commands that are recommended."""
    return shlex.quote(str(file))


_log_folder = Path(tempfile.gettempdir())


def keep_tracebacks_in(folder: Path) -> None:
    """From now on the traceback of an internal error goes to a file in `folder`."""
    global _log_folder
    _log_folder = folder


def run_app(app: Callable[[], None], command: str) -> None:
    """Run a command line program; the user sees sentences, never a traceback.

    An exception that nobody expected is our mistake: its traceback goes to a file, its path to stderr.
    """
    try:
        app()
    except CommandError as error:
        print(f"{command}: {error.what}", file=sys.stderr)
        if error.next_step:
            print(f"  next: {error.next_step}", file=sys.stderr)
        sys.exit(error.exit_code)
    except ConfigError as error:
        print(f"{command}: the configuration is refused", *error.problems, sep="\n  ", file=sys.stderr)
        print("  next: correct it; all problems of a cell at once: cell check FILE", file=sys.stderr)
        sys.exit(1)
    except (NetError, JournalError, GatewayError) as error:
        print(f"{command}: {error}", file=sys.stderr)
        sys.exit(1)
    except Exception as error:
        print(f"{command}: internal error, please report it{_kept(command, error)}: {error!r}", file=sys.stderr)
        sys.exit(1)


def _kept(command: str, error: Exception) -> str:
    """Write the traceback to a file; ` with the file ...`, or nothing when there is no room for one."""
    path = _log_folder / f"internal-error-{command}.log"
    try:
        path.write_text("".join(traceback.format_exception(error)), encoding="utf-8")
    except OSError:
        return ""
    return f" with the file {path}"
