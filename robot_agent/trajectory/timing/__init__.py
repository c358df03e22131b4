"""When the joints pass which place of their path: every limit is kept, and one of them is reached wherever possible.

In go joint paths and limits; out come `Timed` joints over time from rest to rest, or on from a motion that is under
way (`Continuation`). `dispatch` says which timing a path gets; it knows nothing of what the path is made from, of the
governor, or of the samples that are sent.
"""
