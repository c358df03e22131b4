"""The robot file: links, limits, home position and body."""
