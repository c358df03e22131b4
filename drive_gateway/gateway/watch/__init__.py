"""What is looked at in every cycle: following errors, inputs, limit switches, brakes, axes that do not stop.

In go drives as they were measured; out come the position of a robot, its `Trouble`s and events. Nothing is stopped
here: who asks decides what becomes of a trouble.
"""
