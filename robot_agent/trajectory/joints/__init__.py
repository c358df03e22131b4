"""What the joints do along a path: moves of the TCP and of the joints become one joint path where they can.

In go pose paths, joints at the start and the limits; out come `JointPath`s, polynomials over the length of the joints'
way, and a `Transition` for each place where two of them meet. It knows nothing of time: no speed, no profile, no clock.
"""
