"""One simulated node: its network state around its services and drives, and faults on command.

In go all frames of the bus and the time; out come the frames with which the node answers. It knows no clock and
no wire; which fault begins when is ordered from outside, by a call or by an SDO.
"""
