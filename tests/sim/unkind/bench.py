"""A robot of two axes, one of them with an unkind drive: it is started, homed, moved, broken, and brought back.

The drive of J2 is a plain one. Where the axes really are is looked at in every cycle: nothing may move that is not
meant to.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from cell.messages import Claim, EnableDrives, Home, PlayoutState, ResetDrives, SetpointBlock
from drive_gateway.canopen.cob_id import SDO_FROM_NODE, SDO_TO_NODE, SYNC
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.sdo import Sdo, SdoDone
from drive_gateway.config.settings import AxisSettings, GatewaySettings
from tests.sim.bus import outcome_of, request_bytes
from tests.sim.gateway_bench import GatewayBench, axis, homing, settings
from tests.sim.unkind.traits.trait import Trait

UNKIND, PLAIN = 1, 2
UP_WITHIN_S = 60.0
REFUSED_FOR_S = 6.0
"""A drive that is refused is so when it is tried again."""
AT_REST = 0.004
"""[rad] an axis that holds its place stays in this."""
MOVE_S, WAY = 0.6, 0.15
ANSWER_S = 20.0
BRAKE = 0.1
"""[rad] a stop takes less than this from the speeds of here."""


@dataclass(frozen=True, slots=True)
class Changes:
    """What else a drives file says, of its bus and of the axis with the unkind drive."""

    bus: dict[str, object]
    axis: dict[str, object]


NONE = Changes({}, {})


class Refused(Exception):
    """The gateway does not get the robot to do what it should; the text is what it tells people."""


def layout(changes: Changes = NONE) -> GatewaySettings:
    """An axis that homes, and one whose encoder is absolute."""
    unkind: AxisSettings = replace(
        axis("J1", UNKIND, incremental=True, homing=homing(17, 0.45)),
        **changes.axis,  # type: ignore[arg-type]
    )
    return replace(settings(unkind, axis("J2", PLAIN)), **changes.bus)  # type: ignore[arg-type]


class UnkindBench(GatewayBench):
    """Its SDO take as long as the drive does."""

    def __init__(self, traits: Iterable[Trait], changes: Changes = NONE) -> None:
        self._asked: dict[int, tuple[Sdo, float]] = {}
        self._rest: np.ndarray | None = None
        self.strange_syncs = 0
        super().__init__(layout(changes))
        for trait in traits:
            trait.give(self.bus.nodes[UNKIND])

    @property
    def places(self) -> np.ndarray:
        """[rad] where the axes really are."""
        axes = self.settings.robots[self.robot].axes
        return np.array([self.bus.nodes[a.node_id].position / a.counts_per_unit for a in axes])

    def cycle(self, late_s: float = 0.0) -> None:
        super().cycle(late_s)
        for node_id, (request, until) in list(self._asked.items()):
            if self.now > until:
                del self._asked[node_id]
                self.tell(SdoDone(request.request_id, b"", None, "No SDO response received"))
        if self._rest is not None:
            moved = np.abs(self.places - self._rest)
            assert moved.max() < AT_REST, f"an axis moved by {moved.max():.4f} rad and was not meant to"

    def stands(self, standing: bool = True) -> None:
        """From now on nothing may move, or it may again."""
        self._rest = self.places if standing else None

    def _perform(self, effect: object) -> None:
        if not isinstance(effect, Sdo):
            super()._perform(effect)
            return
        self.requests.append(effect)
        self._asked[effect.node_id] = effect, self.now + self.settings.sdo_timeout_s
        self._send(CanFrame(SDO_TO_NODE + effect.node_id, request_bytes(effect)))

    def _deliver(self, message: object) -> None:
        if isinstance(message, CanFrame):
            self.strange_syncs += message.id == SYNC
            asked = self._asked.get(message.id - SDO_FROM_NODE)
            if asked is not None:
                address = asked[0].index.to_bytes(2, "little") + bytes([asked[0].sub])
                if message.data[1:4] == address:
                    del self._asked[message.id - SDO_FROM_NODE]
                    super()._deliver(outcome_of(asked[0], message.data))
                return
        super()._deliver(message)

    # What a robot goes through

    def comes_up(self, hopeless: bool = False) -> None:
        """Raises `Refused`: it is not ready; where it is `hopeless`, nobody waits long for it."""
        self.stands()
        began = self.now
        while self.state is None or not self.state.ready or self.feedback is None:
            self.cycle()
            problem = "" if self.state is None else self.state.problem
            if self.now - began > (REFUSED_FOR_S if hopeless and problem else UP_WITHIN_S):
                raise Refused(problem)
        self.run(0.3)
        self.strange_syncs = 0

    def homes(self) -> None:
        """Raises `Refused`: J1 did not find its home point."""
        self.stands(False)
        before = self.places
        reply = self.ask(Home(self.robot, ()))
        if not reply.ok:
            raise Refused(reply.text)
        if self.held() != "done":
            self._quiet()
            raise Refused(self.said[0])
        assert abs(self.places[1] - before[1]) < AT_REST, "only J1 homes"
        self.stands()
        # The drive gets its mode back before it may be enabled.
        self.run(4 * self.settings.sdo_timeout_s)

    def enables(self) -> int:
        """Raises `Refused`. Answers the owner."""
        self.stands()
        owner = self._claimed()
        self._asked_for(EnableDrives(self.robot, owner))
        return owner

    def moves(self, owner: int, way: float) -> None:
        """All axes over the same way, and no farther. Raises `Refused`: stopped by a fault, at rest since."""
        assert self.feedback is not None
        self.stands(False)
        start, sequence = self.places, round(self.now * 1000)
        block = self._block(owner, sequence, way)
        self.tell(block)
        low, high = np.minimum(start, start + way) - AT_REST, np.maximum(start, start + way) + AT_REST
        for _ in range(round((MOVE_S + 0.4) / self.settings.cycle_s)):
            self.cycle()
            assert ((low < self.places) & (self.places < high)).all(), "beyond the ends of the move"
        if self.feedback.state in (PlayoutState.FAULT, PlayoutState.STOPPING):
            self._quiet()
            raise Refused(next(event.text for event in self.events[::-1] if event.severity.value == "alarm"))
        assert np.abs(self.places - start - way).max() < AT_REST
        self.stands()

    def half_way(self, way: float) -> None:
        """In the middle of a move, where it is fastest."""
        assert self.feedback is not None
        self.stands(False)
        self.tell(self._block(self.feedback.owner, round(self.now * 1000), way))
        self.run(MOVE_S / 2)

    def breaks(self, node_id: int = PLAIN) -> None:
        """A drive fails in motion: both axes stop, and stand."""
        self.half_way(WAY)
        before = self.places
        self.bus.nodes[node_id].raise_emergency(0x4310)
        self.until(lambda: self.feedback is not None and self.feedback.state is PlayoutState.FAULT, within_s=2.0)
        assert np.abs(self.places - before).max() < BRAKE
        self._quiet()

    def returns(self) -> int:
        """Claimed anew, reset and enabled. Raises `Refused`. Answers the owner."""
        owner = self._claimed()
        self._asked_for(ResetDrives(self.robot, owner))
        self._asked_for(EnableDrives(self.robot, owner))
        return owner

    def _claimed(self) -> int:
        """Raises `Refused`."""
        reply = self.ask(Claim(self.robot, "a", "d"))
        if reply.claim is None:
            raise Refused(reply.text)
        return reply.claim.owner

    def _asked_for(self, command: ResetDrives | EnableDrives) -> None:
        """Raises `Refused`, and nothing has moved."""
        request_id = self.request(command)
        until = self.now + ANSWER_S
        while request_id not in self.replies:
            assert self.now < until, f"no answer to {command.verb}"
            if self.feedback is not None and self.feedback.tick % 5 == 0:
                # An owner is heard all the time.
                self.tell(self._block(command.owner, round(self.now * 1000), 0.0))
            self.cycle()
        if not self.replies[request_id].ok:
            self._quiet()
            raise Refused(self.replies[request_id].text)

    def _block(self, owner: int, sequence: int, way: float) -> SetpointBlock:
        assert self.feedback is not None
        cycle_s = self.settings.cycle_s
        s = np.arange(0.0, MOVE_S + cycle_s / 2, cycle_s) / MOVE_S
        ways = np.array([way, way])
        position = self.feedback.commanded + np.outer(s**3 * (10 - 15 * s + 6 * s**2), ways)
        velocity = np.outer(30 * s**2 * (1 - s) ** 2 / MOVE_S, ways)
        first = self.feedback.tick + 5
        return SetpointBlock(self.robot, owner, sequence, 0, first, cycle_s, len(s), position, velocity)

    def _quiet(self) -> None:
        """Whatever happened, after it everything stands, and goes on standing."""
        self.run(0.5)
        self.stands()
        self.run(1.0)


def life(traits: Iterable[Trait], changes: Changes = NONE, hopeless: bool = False) -> UnkindBench:
    """From power-on to a second enabling. Raises `Refused` with what the gateway tells people."""
    world = UnkindBench(traits, changes)
    lived(world, hopeless)
    return world


def lived(world: UnkindBench, hopeless: bool = False) -> None:
    """The same with a robot that is there already."""
    world.comes_up(hopeless)
    world.homes()
    owner = world.enables()
    world.moves(owner, WAY)
    world.breaks()
    world.returns()
    world.breaks(UNKIND if UNKIND in world.bus.nodes else PLAIN)
    world.moves(world.returns(), -WAY / 2)
