"""How the drives of a drives file are simulated: the schema of the file beside it, its checks, and what it says.

In goes `NAME.sim.yaml` beside `NAME.yaml`, which real drives never see; out comes a `Simulation` in SI units. It knows
the drives file and the data of the axes behind the drives, and no node and no bus.
"""
