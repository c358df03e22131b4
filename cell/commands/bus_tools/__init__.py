"""An operator's tools for one CAN bus: scan it, read, write, store and log, let a simulated drive fail, tune an axis.

In go a cell file, a gateway and a node; out come objects, frames and curves, through the running gateway where there is
one (`node_access`). Nothing here knows of programs, zones or other buses.
"""
