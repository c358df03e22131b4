"""The set-up of one robot: which motion its drives make by themselves now, how the newest one ended, what remains."""

from collections.abc import Sequence

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.cia402.units import INT16_MAX
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.event_log import EventLog
from drive_gateway.gateway.setup.mode_keeper import ModeKeeper
from drive_gateway.gateway.setup.setup_axis import Stage
from drive_gateway.gateway.setup.setup_motion import SetupMotion
from drive_gateway.gateway.trouble import Trouble


class SetupDesk:
    """At most one motion at a time; afterwards its drives go back to the mode in which blocks are played."""

    def __init__(self, log: EventLog) -> None:
        self._log = log
        self._modes = ModeKeeper(log)
        self.motion: SetupMotion | None = None
        """What goes on."""
        self.order = ""
        """Id of the call that ordered the newest motion: only who made it holds it."""
        self.ended: SetupMotion | None = None
        """The newest motion that is over."""

    @property
    def busy(self) -> bool:
        """A motion goes on, or a drive is not yet back in its mode."""
        return self.motion is not None or not self._modes.settled

    @property
    def problem(self) -> str:
        """Which drives do not go back to their mode, and why; empty when all do."""
        return self._modes.problem

    def begin(self, motion: SetupMotion, order: str, nodes: Sequence[Drive]) -> None:
        self.motion, self.order = motion, order
        for node in nodes:
            self._modes.left(node)

    def stop(self, reason: str, now: float) -> None:
        """Let the drives stop and switch off; nothing when nothing goes on."""
        if self.motion is not None:
            self.motion.stop(reason, now)

    def abandon(self, reason: str, now: float) -> None:
        """A fault: from here on the power of the whole robot commands the drives."""
        self.stop(reason, now)
        self._end()

    def wants(self, drive: Drive) -> bool:
        """A motion of the drive's own goes on that is not to end yet."""
        axis = None if self.motion is None else self.motion.controls(drive)
        return axis is not None and axis.stage not in (Stage.STOPPING, Stage.SWITCHING_OFF)

    def step(self, now: float) -> list[Trouble]:
        """One cycle; answers what the robot must be stopped for."""
        if self.motion is not None:
            self.motion.step(now)
            if troubles := self.motion.troubles():
                return troubles
            if self.motion.ended:
                self._end()
        else:
            # Not before: what a drive shows while it is prepared is its mode from before the motion.
            self._modes.step(now)
        return []

    def command(self, node: Drive, carrying: int, now: float) -> list[CanFrame] | None:
        """What a drive that moves by itself is told in this cycle; `None` for all others.

        `carrying` is what its axis needs at rest, as far as it is known [per mille of its motor's rated torque].
        """
        axis = None if self.motion is None else self.motion.controls(node)
        if axis is None:
            return None
        if axis.order.press is not None:
            most = INT16_MAX
            return node.press(axis.controlword, max(-most, min(most, carrying + axis.torque)))
        return node.command_own(axis.controlword, axis.target, axis.velocity, now)

    def _end(self) -> None:
        ended, self.motion = self.motion, None
        if ended is None:
            return
        self.ended = ended
        if ended.problem:
            text = f"{ended.what} stopped: {ended.problem}"
            self._log.warn("setup_stopped", text, "remove the cause and begin again; axes may be unreferenced")
        else:
            self._log.info("setup_done", f"{ended.what} is done")
