"""One CAN bus: the CANopen master, its CiA 402 drives, the simulated drives and the gateway process."""
