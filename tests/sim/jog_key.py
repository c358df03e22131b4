"""A jog key that an operator holds for a while."""

from cell.messages import Jog, JogFrame, JogHeld
from tests.sim.world import World

_KEY_S = 0.03
"""How often a jog key says that it is held."""


def hold_key(world: World, by: str, robot: str, axis: str, speed: float, held_s: float, *, lets_go: bool) -> None:
    """Press it now; `lets_go`: it says in the end that it is held no more."""
    press, until = f"{by}-{world.clock.now:.3f}", world.clock.now + held_s
    world.operate(f"robot/{robot}", Jog(press, axis, speed, JogFrame.BASE), by)

    def hold() -> None:
        heard = world.operator(by).heard(f"robot/{robot}")
        held = world.clock.now < until
        if heard is not None and (held or lets_go):
            world.press(JogHeld(robot, press, held, heard), by)
        if held:
            world.clock.after(_KEY_S, hold)

    hold()
