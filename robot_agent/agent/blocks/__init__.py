"""From planned motions to set-point blocks: which comes next, where it joins, and what became of those sent.

In go `Planned` motions, wishes of the next block and feedback; out come blocks, with corrections and outputs on them,
and the body that they imply. It knows what is wanted of a block, and nothing of who wants it and in which mode.
"""
