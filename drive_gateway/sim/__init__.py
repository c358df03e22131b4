"""Simulated drive nodes: CANopen slaves with the CiA 402 profile that parse frames, move and fail.

On top: the bus with its wire, and the shell that carries frames and time. Below: nodes/ a node and its faults; drives/
CiA 402; services/ CiA 301; axis/ what moves. In go the drives file and frames; out come frames. No node knows who its
master is.
"""
