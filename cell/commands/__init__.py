"""The commands `cell`, `robot-agent` and `drive-gateway`: here all parts of the program are put together.

In go command lines and files; out come processes, orders to a running cell, and text with an exit code for people. It
must not decide what a running cell does, which is up to the process that gets an order; nothing imports it, and a
subcommand imports what it needs when it is asked for, so that a stop waits for no kinematics.
"""
