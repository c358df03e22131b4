"""The CiA 402 drive profile, master side: state machine, units and the objects a drive is prepared with.

In go settings, statuswords, positions and wishes; out come states, controlwords, counts, values for objects, and the
times of motions that a drive makes by itself. It must not know the running gateway, nor of which robot an axis is: it
sends nothing, and waits for nothing.
"""
