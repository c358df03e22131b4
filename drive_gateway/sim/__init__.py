"""Simulated drive nodes: CANopen slaves with the CiA 402 profile that parse frames, move with a lag and fail."""
