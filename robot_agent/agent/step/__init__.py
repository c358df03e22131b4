"""What each step of the core asks: what goes on by itself, what is wanted of the next block, why the robot stands.

In go the mode and everything the agent knows; out come the next mode, the wishes of the next block, and what is told of
it. These look at all wings and keep next to nothing; what they find, the core carries out.
"""
