"""How messages travel between the processes of a cell, over Zenoh, and how a process knows what it may still trust.

In go messages, calls and the place of a process in the topology; out come payloads on keys, what was heard with its
age, the cell clock, and answers or why there are none. It must not know the cell file, nor what a process does with a
message: it runs a core without knowing which.
"""
