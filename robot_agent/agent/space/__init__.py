"""What a robot may use of the cell's space: it moves only within what the manager has cleared for it.

In go the sections of its way and the manager's clearances, out comes how far it may go. It knows sections by their ids
alone: neither their shape nor the motion that they were cut from.
"""
