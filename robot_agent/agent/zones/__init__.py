"""The zones of the cell as this robot sees them: what it holds, what it wants, and where it says it is.

In go the manager's states and the bodies of motions and samples; out come presences, holds in front of closed zones,
and whether a way is open. It grants nothing, and knows nothing of programs and modes.
"""
