"""A robot that runs its program, as it tells it."""

from cell.messages import GovernorStatus, Mode, ProgramState, ProgramStatus, RobotState

RUNNING = RobotState(
    robot="left",
    boot="b",
    sequence=1,
    mode=Mode.RUNNING,
    program=ProgramStatus("left.prog", ProgramState.RUNNING, 8, "ML X=1650"),
    joints=(0.0,) * 6,
    tcp_position_m=(1.0, 0.0, 0.5),
    tcp_quaternion_xyzw=(0.0, 0.0, 0.0, 1.0),
    tcp_speed_m_s=0.25,
    governor=GovernorStatus(1.0, 0.4, 2.0, ""),
)
