"""Entry point of the command `cell`."""

from cell.commands.start import start


def main() -> None:
    """Run `cell` with the words of the command line."""
    start("cell.commands.cell_command")


if __name__ == "__main__":
    main()
