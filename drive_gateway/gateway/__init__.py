"""The process that owns one CAN bus: core and shell, the effects between them, and a wing for each part of the work.

From the wire upwards: bus/ the CAN bus of this host; reference/ where axes are; playout/ blocks to samples; nodes/ and
drives/ what is on the bus; watch/ what is looked at in each cycle; setup/ motion of the drives' own; robots/ the drives
of a robot as one; orders/ calls and their answers; cycle/ the bus as a whole. It knows drives and blocks, nothing of
joints, programs and zones.
"""
