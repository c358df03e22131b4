"""Entry point of the command `cell`."""

import os
import sys

from cell.commands.start import start


def main() -> None:
    """Run `cell` with the words of the command line; an emergency stop goes the short way."""
    stops = sys.argv[1:2] == ["estop"] and not {"-h", "--help"} & set(sys.argv[2:])
    if stops:
        os.environ.pop("ZENOH_RUNTIME", None)  # one that Zenoh cannot read would keep the stop back
    start("cell.commands.emergency.stop" if stops else "cell.commands.cell_command")


if __name__ == "__main__":
    main()
