"""The agent process of one robot: claim, program, planning ahead, set-point blocks, presence."""
