"""Entry point of the command `drive-gateway`."""

from cell.commands.start import start


def main() -> None:
    """Run `drive-gateway` with the words of the command line."""
    start("cell.commands.drive_gateway_command")


if __name__ == "__main__":
    main()
