"""Inputs and outputs beside the motion: I/O nodes (CiA 401), and the inputs of drives and I/O nodes by their names.

In go TPDOs with inputs and what robots want of their outputs; out come the frames of the outputs, and inputs that are
known, or not. It knows nothing of power and blocks; who stops when an I/O node falls silent is decided above.
"""
