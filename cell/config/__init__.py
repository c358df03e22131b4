"""Configuration files: YAML with declared units in, settings in SI or all problems with line and column out."""

from cell.config.load import load_cell, load_cell_alone
from cell.config.problem import ConfigError, Problem, Severity

__all__ = ["ConfigError", "Problem", "Severity", "load_cell", "load_cell_alone"]
