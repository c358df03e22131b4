"""A button that moves a robot while it is held: from the browser's signs to the robot's jog key."""

import asyncio
import uuid
from collections.abc import Callable, Coroutine
from dataclasses import replace

import viser

from cell.messages import Go, Heard, Jog, JogHeld, RobotState
from cell.messages.common import Name, Text
from cell.view.desk import Desk, NoAnswer
from cell.view.hold import Hold, Press
from cell.view.newest import Newest
from cell.view.server import Here

SIGNS_HZ = 30.0
PING_S = 0.03
SETTLE_S = 0.02
"""After an answer: what came before it has been handed on by then."""
RELEASES = 3
LET_GO = "the signs of the button came late or not at all: let it go, and press it again"

Wish = Callable[[], tuple[Name, Jog | Go] | None]
"""What holding the button asks for now, of which robot; None where it may not, or nothing is chosen."""


class JogButton:
    """One hold button of one browser. All of it runs on the loop of the page's server."""

    def __init__(
        self,
        button: viser.GuiButtonHandle,
        here: Here,
        desk: Desk,
        seen: Newest,
        wish: Wish,
        say: Callable[[Text], None],
    ) -> None:
        self._here = here
        self._desk = desk
        self._seen = seen
        self._wish = wish
        self._say = say
        self._hold = Hold()
        self._press: tuple[Name, str] | None = None
        """The robot that moves, and the press that its agent knows."""
        self._tasks: set[asyncio.Task[None]] = set()
        self._pings: asyncio.Task[None] | None = None
        button.on_hold(self._sign, callback_hz=SIGNS_HZ)
        button.on_click(self._let_go)

    async def _sign(self, _event: object) -> None:
        """The browser says that the button is held."""
        wish = self._wish()
        if wish is None:
            self._press = None
            return
        before = self._hold.press
        counts = self._hold.sign(asyncio.get_running_loop().time())
        if self._hold.press is Press.OVER:
            self._press = None
            if before is not Press.OVER:
                self._say(LET_GO)
            return
        if self._pings is None or self._pings.done():
            self._pings = self._start(self._ping())
        if counts and self._press is None:
            robot, command = wish
            self._press = robot, uuid.uuid4().hex
            self._start(self._begin(robot, replace(command, press=self._press[1])))
        elif counts:
            self._tell(held=True)

    async def _let_go(self, _event: object) -> None:
        """The browser says that the button was let go."""
        self._hold.let_go()
        for _ in range(RELEASES if self._press is not None else 0):
            self._tell(held=False)
        self._press = None

    def _tell(self, held: bool) -> None:
        if self._press is None:
            return
        robot, press = self._press
        state = self._seen.last(RobotState, robot)
        if state is not None:
            self._desk.hold(JogHeld(robot, press, held, Heard(state[0].boot, state[0].sequence)))

    async def _begin(self, robot: Name, command: Jog | Go) -> None:
        """Ask the robot's agent to begin this press."""
        state = self._seen.last(RobotState, robot)
        if state is None:
            self._say(f"robot {robot} does not answer")
            return
        heard = Heard(state[0].boot, state[0].sequence)
        try:
            reply = await asyncio.to_thread(self._desk.ask, f"robot/{robot}", command, heard)
        except NoAnswer as error:
            self._say(str(error))
        else:
            self._say(f"{robot}: {reply.text}")

    async def _ping(self) -> None:
        """Ask the browser again and again whether it is there, as long as the button is held."""
        while self._hold.look(asyncio.get_running_loop().time()) in (Press.ASKED, Press.HELD):
            self._start(self._one_ping())
            await asyncio.sleep(PING_S)

    async def _one_ping(self) -> None:
        sent_at = await self._here.ping()
        await asyncio.sleep(SETTLE_S)
        self._hold.answered(sent_at)

    def _start(self, work: Coroutine[None, None, None]) -> asyncio.Task[None]:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._done)
        return task

    def _done(self, task: asyncio.Task[None]) -> None:
        """A connection that went takes its pings along."""
        self._tasks.discard(task)
        if not task.cancelled():
            task.exception()
