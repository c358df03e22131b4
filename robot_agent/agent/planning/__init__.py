"""From steps of a program to planned motions: which are planned together, ahead of the robot, in a process of its own.

In go steps, joints at the start and the zones of the cell; out come `Planned` motions with the bodies they sweep, or
why there is none. It knows no drive, no clock of the cell and no grant: the same plans come of a program on a desk.
"""
