"""The CiA 402 drive profile, master side: state machine, units and the objects a drive is prepared with."""
