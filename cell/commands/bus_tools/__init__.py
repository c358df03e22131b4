"""An operator's tools for one CAN bus: its nodes, their objects, states, errors and Node-IDs; its frames.

In go a bus (`place`: a cell file and a gateway, a drives file, or options) and a node; out come objects, frames and
curves, through the running gateway where there is one (`node_access`), else on the bus itself (`bus_line`). What
needs no bus is here too: a plan of the boot, a check of the file, the tuning of a simulated axis. Nothing here knows of
programs, zones or other buses.
"""
