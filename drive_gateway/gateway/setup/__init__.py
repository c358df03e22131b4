"""Motion that drives make by themselves, in set-up: homing, moves to a position, torque.

In go orders for single drives; out come controlwords and targets for each cycle, and how the motion ended. It knows
neither who asked nor whether the robot may: the wish is judged in `robots`, the turn in `orders`.
"""
