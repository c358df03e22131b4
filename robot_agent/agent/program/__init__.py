"""One run of a program and its motion on the path: state, pace, stops off the path and the way back.

In go what the gateway has accepted and what an operator sets; out come the line in execution, what follows next, and
how far the robot is from its path. It does not know how a call is judged and answered.
"""
