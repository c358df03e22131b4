"""An operator at a jog key of one agent."""

from collections.abc import Callable

from cell.messages import Heard, Jog, JogFrame, JogHeld, Mode
from tests.unit.agent_world import STEP_S, AgentWorld


class Key:
    """An operator's side: the call, and the signs of life while the key is held."""

    def __init__(self, world: AgentWorld, command: Jog) -> None:
        self.world, self.command = world, command
        self.call = world.call(command)

    def hold(self, seconds: float, lost: bool = False, until: Callable[[], bool] | None = None) -> None:
        for _ in range(round(seconds / STEP_S)):
            if until is not None and until():
                return
            if not lost:
                self.say(True)
            self.world.step()

    def say(self, held: bool, heard: Heard | None = None) -> None:
        state = self.world.state
        heard = heard or Heard(state.boot, state.sequence)
        self.world.agent.receive(JogHeld("left", self.command.press, held, heard), self.world.now)

    def hold_to_the_end(self) -> None:
        """Hold the key until the press has ended by itself and the robot rests."""
        self.hold(STEP_S)
        assert self.world.state.mode is Mode.JOGGING
        self.hold(3.0, until=lambda: self.world.state.mode is Mode.READY)
        assert self.world.state.mode is Mode.READY

    @property
    def refusal(self) -> str:
        """Why the call was refused, once it is answered; empty when it was not."""
        if self.call not in self.world.replies:
            self.world.step()
        reply = self.world.replies[self.call]
        return "" if reply.ok else reply.text


def jog(axis: str, speed: float, step: float | None = None, press: str = "one") -> Jog:
    return Jog(press, axis, speed, JogFrame.WORLD, step)
