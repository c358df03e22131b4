"""Where the robot is and what it wants, for the manager."""

from cell.core import Publish
from cell.messages import Body, Heard, Meets, Mode, Presence
from cell.net.estops import ObeyedEstops
from robot_agent.agent.space.shared_space import SharedSpace, Use
from robot_agent.agent.zones.zone_claims import ZoneClaims


class Announcer:
    """Numbers the presences of one robot and remembers the body in the newest one."""

    def __init__(self, robot: str, boot: str, digest: str, zones: ZoneClaims, space: SharedSpace) -> None:
        self._robot = robot
        self._boot = boot
        self._digest = digest
        self._zones = zones
        self._space = space
        self._sequence = 0
        self.body: Body | None = None
        """None before the first presence."""

    @property
    def newest(self) -> Heard:
        """The newest presence, as a manager repeats it."""
        return Heard(self._boot, self._sequence)

    def entered(self, body: Body) -> set[str]:
        """The zones that a body is in and the newest announced one was not."""
        before = self._zones.touched(self.body) if self.body is not None else set()
        return self._zones.touched(body) - before

    def presence(
        self,
        owner: int,
        mode: Mode,
        meets: Meets,
        body: Body,
        use: Use,
        wants: dict[str, float],
        stop_time_s: float,
        estops: ObeyedEstops,
        now: float,
        *,
        standing: bool = False,
    ) -> Publish:
        """The next presence under the claim `owner`.

        `body` is everything between here and rest, `use` what it uses of the cell's space, `estops` holds the stop to
        acknowledge; `standing`: see `Presence`.
        """
        self.body = body
        self._sequence += 1
        self._zones.sent_presence(self._sequence, body, now)
        estop = estops.first
        if estop is not None:
            estops.named(estop.id, self._sequence)
        return Publish(
            Presence(
                robot=self._robot,
                boot=self._boot,
                owner=owner,
                sequence=self._sequence,
                heard=self._zones.heard,
                digest=self._digest,
                body=body,
                stop_time_s=stop_time_s,
                holds=dict(self._zones.holds),
                wants=wants,
                estop_acknowledged=estop.id if estop is not None else None,
                standing=standing,
                epoch=self._space.epoch,
                taken=self._space.taken,
                way=self._space.way(self._sequence, use),
                mode=mode,
                meets=meets,
            )
        )
