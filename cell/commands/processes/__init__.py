"""What the processes of a cell have in common: state folder and lock, log, and how each learns that it should end.

In go settings and the body of a process; the body runs until a signal, or the end of its parent. Only `manager` and
`robot_loads` know what a process does; nothing here knows of the other processes that run.
"""
