"""A PI controller with a limited output whose integral stops where it would only wind up."""


class Regulator:
    """y = kp e + integral(ki e) + ahead, within a limit.

    While the output is limited, the integral takes only errors that lead back (conditional integration).
    """

    def __init__(self, kp: float, ki: float, step_s: float) -> None:
        self.kp = kp
        self._gain = ki * step_s
        self.integral = 0.0
        self.limited = False

    def reset(self) -> None:
        self.integral = 0.0
        self.limited = False

    def resume(self, output: float, error: float) -> None:
        """Go on from an output that something else gave at this error."""
        self.integral = output - self.kp * error
        self.limited = False

    def step(self, error: float, ahead: float, limit: float) -> float:
        """One step; `ahead` is fed forward, the result is within +-`limit`."""
        integral = self.integral + self._gain * error
        output = self.kp * error + ahead + integral
        if -limit <= output <= limit:
            self.integral, self.limited = integral, False
            return output
        self.limited = True
        if (output > limit) == (error < 0.0):
            self.integral = integral
        return limit if output > limit else -limit
