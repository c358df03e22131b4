"""The drive of one axis (CiA 402): power states, modes of operation, homing, monitoring, and how it stops.

In go writes to its objects and the time; out come the demand of its axis, what it shows, and emergencies. It knows its
own objects only: not the node's network state, not the other axes, and no frame.
"""
