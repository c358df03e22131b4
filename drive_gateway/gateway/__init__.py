"""The process that owns one CAN bus: playout of set-point blocks, claims, drives of each robot, core and shell."""
