"""Each axis and its drive: what it last said, whether it stands, and what it is told.

In go TPDOs, samples and what the node says; out come RPDOs and what is known of each axis. `Power` leads the drives of
a robot as one; why they are switched on or stopped is decided above.
"""
