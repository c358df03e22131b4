"""Configuration files: YAML with declared units in, settings in SI or all problems with line and column out.

In go the cell file, points files, and values to be written into them; out come settings, problems, the digest, and
files in which nothing else has changed. It must not know what the files of robots and drives say, which are read by
`robot_agent.model` and `drive_gateway.config` with what is here, nor a running process.
"""

from cell.config.load import load_cell, load_cell_alone
from cell.config.problem import ConfigError, Problem, Severity

__all__ = ["ConfigError", "Problem", "Severity", "load_cell", "load_cell_alone"]
