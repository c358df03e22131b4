"""Entry point of the command `robot-agent`."""

from cell.commands.start import start


def main() -> None:
    """Run `robot-agent` with the words of the command line."""
    start("cell.commands.robot_agent_command")


if __name__ == "__main__":
    main()
