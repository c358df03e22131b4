"""The process that arbitrates between the robots of a cell: zones, room, meetings, set-up, frames, emergency stops.

In go the settings of the cell file, what robots and gateways tell, and calls; out come grants and clearances, the state
of the manager, answers, and what its journal and the cell file must keep. It must not know kinematics, what programs
say, drives or buses: of a robot it has what its agent and its gateway tell.
"""
