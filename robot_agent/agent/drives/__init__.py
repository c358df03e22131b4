"""The drives of the robot as the agent has them through its gateway: claimed, heard, switched, and measured at rest.

In go feedback and replies of the gateway; out come calls to it, joints instead of axes, and whether the robot stands.
It knows nothing of programs, nor what the robot does while they are enabled.
"""
