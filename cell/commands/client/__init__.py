"""How a command finds the running cell, hears it and asks it.

In go a cell file and the endpoints of the command line; out come the settings, the newest states of all processes
(`CellView`), the replies to orders, and tables of both. A client knows messages and calls, never the inside of a
process; what an order means is the business of the command that gives it.
"""
