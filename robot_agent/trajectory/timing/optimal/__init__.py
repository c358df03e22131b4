"""The fastest timing under limits of speed, acceleration and jerk, searched for.

In go joint paths and their limits along the way; out come `Timed` joints that keep them, from rest (`time_optimal`) or
in motion (`onward`). The search changes the rate of an initial law until nothing is faster; it knows nothing of
profiles, nor of the filter on the axes.
"""
