"""The CAN bus as this host has it: opened, kept open, read, written, recorded, and SDO transfers beside the cycle.

In go the bus of a drives file and frames; out come frames, outcomes of SDO requests, and news of the bus. Threads and
waits are at home here and in the shell only; no module knows of drives, robots or the cycle.
"""
