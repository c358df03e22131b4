"""Ways in which real drives differ from the plain simulated one, each with where that is known from.

In goes a simulated node, out comes the same node with a habit. Nothing here knows a gateway: a trait is written from
the standard, a manual or a report, never from what a master does.
"""
