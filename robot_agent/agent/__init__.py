"""The agent process of one robot: core and shell, the cell clock, and a wing for each part of the work.

From plan to answer: planning/ steps to motions; drives/ the robot's drives through its gateway; zones/ what is held and
wanted; blocks/ motions to set points; program/ one run of a program; operator/ calls and the jog key; step/ what the
core asks in each step. It knows messages and joints, and nothing of CAN, nodes and other robots.
"""
