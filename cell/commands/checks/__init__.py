"""All checks of a cell together: the cell file, every file that it names, and what they say about each other."""

from cell.commands.checks.bundle import CellBundle, check_cell

__all__ = ["CellBundle", "check_cell"]
