"""The nodes of a bus: looked for, brought up, supervised, and stopped by NMT as the last means.

In go boot-ups, heartbeats, emergencies and outcomes of SDO requests; out come frames, requests, and the troubles of a
node. A node tells its axes what befalls it (`AxisOfNode`), and knows nothing of power, blocks and robots.
"""
