"""The axis behind a drive, at two levels: `Servo` follows with a lag, `FullServo` has a motor, a loop and limits.

In go targets of the drive, loads and the time; out come position, velocity, torque and trips of the axis (`AxisServo`).
An axis is counts and physics: it knows no object, no state of power and no frame.
"""
