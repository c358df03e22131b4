"""What the drives of one robot are told by blocks: one sample per SYNC, and outputs in step with them.

In go set-point blocks; out come samples, the outputs that are on, or the reason why a block was dropped. It knows no
drive and no measurement: neither what is sent of it nor whether anything follows.
"""
