"""What each step of the core asks: what goes on by itself, and what a robot does in its mode, wants, and waits for.

In go the mode and everything the agent knows; out come the next mode, the wishes of the next block, and what is told of
it. These look at all wings and keep next to nothing; what they find, the core carries out.
"""
