"""One robot: its model, kinematics, paths, trajectories, programs and the agent process."""
