"""A clock for the loop around a core that goes on only when somebody sleeps or is held up."""


class Clock:
    """Stands for the module `time` of the loop: it goes on when somebody sleeps or is held up, and not otherwise."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.sleeps_longer_s = 0.0

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds + self.sleeps_longer_s
        self.sleeps_longer_s = 0.0
