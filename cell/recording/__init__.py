"""Recordings of a cell: every message that it publishes, in one MCAP file, and what can be made of such a file.

In go messages with the moment at which they were heard, and the files of the cell; out come a file that Foxglove opens,
the same messages back, and numbers over time. It must not know how messages arrive, which command asks for it, nor any
robot's kinematics: bodies, frames and joints are drawn by what the messages say. What needs the optional group `record`
is `writer`, `scene`, `layout` and `reader`; `ring` and `summary` work without it.
"""
