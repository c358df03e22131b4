"""I/O nodes (CiA 401): what is written to them before their outputs are switched.

In go the settings of a node and which of its outputs are to be on; out come values for its objects, each with the
object that shows it. It must not know who writes them, when and over which bus, nor whose outputs they are.
"""
