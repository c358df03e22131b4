"""Who owns a robot's drives: one agent at a time, by number, ended by release or by silence at rest."""

from dataclasses import dataclass

from cell.messages import SetpointBlock


@dataclass(frozen=True, slots=True)
class ClaimRefused:
    text: str


class ClaimBook:
    """The claims of one robot. Numbers grow from `first_owner`, which the shell picks so that none ever comes back."""

    def __init__(self, robot: str, first_owner: int, silent_s: float) -> None:
        self._robot = robot
        self._next = max(first_owner, 1)
        self._silent_s = silent_s
        self._replaced: set[str] = set()
        self._last_boot = ""
        self._alive_at = 0.0
        self._newest_block = 0
        self.owner = 0
        """Number of the present claim; 0: nobody."""
        self.boot = ""
        self.epoch = 0
        """The highest of a manager that an owner's block told of; the next owner trusts no earlier manager."""

    def claim(self, boot: str, at_rest: bool, now: float) -> int | ClaimRefused:
        """The number of the claim; the owner that asks again gets the number it has."""
        if self.owner and boot == self.boot:
            self._alive_at = now
            return self.owner
        if boot in self._replaced:
            text = f"robot {self._robot}: boot {boot} was replaced by {self._last_boot}; restart this agent"
            return ClaimRefused(text)
        if self.owner:
            silent_s = now - self._alive_at
            return ClaimRefused(
                f"robot {self._robot} is owned by boot {self.boot} (owner {self.owner}), last heard {silent_s:.2f} s "
                f"ago; stop that agent, or wait {self._silent_s} s of its silence with the robot at rest"
            )
        if not at_rest:
            return ClaimRefused(f"robot {self._robot} still moves; ask again when it is at rest")
        if self._last_boot and self._last_boot != boot:
            self._replaced.add(self._last_boot)
        self.owner, self.boot, self._last_boot, self._newest_block = self._next, boot, boot, 0
        self._next += 1
        self._alive_at = now
        return self.owner

    def alive(self, owner: int, now: float) -> None:
        """This owner lives: a call of it came."""
        if owner == self.owner:
            self._alive_at = now

    def sent(self, block: SetpointBlock, now: float, *, accepted: bool) -> None:
        """A set-point block came. One that is played proves that its owner lives, and any newer one that came.

        One that the network held back or repeats does not; nor may a stray one of a higher sequence silence the owner.
        """
        if block.owner != self.owner:
            return
        self.epoch = max(self.epoch, block.epoch)
        if accepted or block.sequence > self._newest_block:
            self._newest_block = max(self._newest_block, block.sequence)
            self._alive_at = now

    def expire(self, at_rest: bool, now: float) -> bool:
        """End the claim of an owner that is silent while its robot is at rest; true when it ended by this."""
        if not self.owner or not at_rest or now - self._alive_at <= self._silent_s:
            return False
        self.end()
        return True

    def end(self) -> None:
        self.owner, self.boot = 0, ""

    def problem_of(self, owner: int) -> str:
        """Why a call of this owner is refused; empty when it is the present one."""
        if owner and owner == self.owner:
            return ""
        present = f"the present owner is {self.owner} (boot {self.boot})" if self.owner else "nobody owns it"
        return f"robot {self._robot}: owner {owner} may not command it, {present}; claim it first"
