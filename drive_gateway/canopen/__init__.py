"""CANopen (CiA 301) as bytes and as deterministic state: frames, identifiers, PDO mapping, NMT, EMCY, the SDO queue."""
