"""The bus as a whole in its cycle: when cycles begin, what goes over the wire, and what follows when it fails.

In go the times of cycles, the manager's clock, and news of the bus; out come counters, the trim of the next cycle, and
faults of all robots together. What one node or drive does is not looked at.
"""
