"""Whether an axis is where its encoder says: what is kept of it while it is off, and how that is judged at its start.

In go readings of an encoder and what was stored of its axis; out come a verdict, what to do, and what must be stored
next. Nothing here knows of nodes, frames and power; `position_store` is the file, and belongs to the shell.
"""
