"""A program that runs without its robot: a picture of it, which moves nothing, switches nothing and asks for no room.

In go what the agent hears of the cell, and orders to the run; out come answers, orders for plans, and the picture. The
run is that of another agent's core, which is in a cell without zones and without other robots, and whose gateway is
here. Of all that this core wants done nothing else leaves the wing.
"""
