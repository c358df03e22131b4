"""How fast planned time advances, and how it comes to rest: the governor of path time.

In go a motion, its limits, requests for a rate and holds; out comes a `Segment`, samples along the motion that end at
rest. It takes a motion as it is and knows nothing of how it was planned, nor of who asks for a rate and why.
"""
