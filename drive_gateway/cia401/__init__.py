"""I/O nodes (CiA 401): what is written to them before their outputs are switched."""
