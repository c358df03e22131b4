"""One robot on the bus: its claim, and its drives as one group that is enabled, played, stopped and set up.

In go the calls of its owner, blocks, and orders to stop; out come frames, feedback, and the reason for everything that
is refused. A robot knows neither the other robots of the bus nor whose call it answers.
"""
