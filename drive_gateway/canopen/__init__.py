"""CANopen (CiA 301) as bytes and as deterministic state: frames, identifiers, PDO mapping, NMT, EMCY, the SDO queue.

In go numbers, frames and EDS files; out come frames, states, objects by name, and effects that ask for an SDO. It must
not know the drives file, units or what a drive is to do, and it opens no bus and reads no clock; of CiA 401 and CiA 402
it has the objects and what PDOs carry, and no more.
"""
