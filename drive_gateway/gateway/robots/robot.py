"""One robot on the bus: its claim, its drives, the calls of its owner, and what is published about it."""

from collections.abc import Iterator, Mapping, Sequence

from cell.config.settings import Times
from cell.core import Effect, Publish
from cell.messages import (
    Claim,
    ClaimGrant,
    DisableDrives,
    EnableDrives,
    Release,
    ResetDrives,
)
from cell.messages.drives import DriveFeedback
from cell.messages.setpoints import SetpointBlock
from cell.net.freshness import Sent
from drive_gateway.config.settings import GatewaySettings, RobotDrives
from drive_gateway.gateway.event_log import EventLog
from drive_gateway.gateway.io.io_node import IoNode
from drive_gateway.gateway.playout.joining import JoinRule, RefusedBlock
from drive_gateway.gateway.reference.encoder_record import EncoderRecord
from drive_gateway.gateway.robots.claims import ClaimBook, ClaimRefused
from drive_gateway.gateway.robots.group import DriveGroup, Then
from drive_gateway.gateway.robots.hand_switch import HandSwitch
from drive_gateway.gateway.robots.permits import StopOrder
from drive_gateway.gateway.robots.setup_plan import SetupCall, planned
from drive_gateway.gateway.watch.measurement import Floats

HARMLESS = frozenset({JoinRule.LATE, JoinRule.POSITION, JoinRule.VELOCITY, JoinRule.CLOSING})
"""What a busy computer or a lost block brings about: the queue plays on, and the agent's next block joins it."""
MANY = 100
"""So many harmless refusals, of the some 500 blocks that come meanwhile, are worth a warning."""


class Robot:
    """The owner's view of a robot's drives."""

    def __init__(
        self,
        drives: RobotDrives,
        settings: GatewaySettings,
        times: Times,
        boot: str,
        first_owner: int,
        log: EventLog,
        stored: Mapping[str, EncoderRecord],
        io_nodes: Mapping[str, IoNode],
    ) -> None:
        self.name = drives.robot
        self.group = DriveGroup(drives, settings, log, stored, io_nodes)
        self.hand = HandSwitch(self.group, log)
        self.claims = ClaimBook(drives.robot, first_owner, times.owner_silent_s)
        self._settings = settings
        self._axes = tuple(axis.name for axis in drives.axes)
        self._quick_stop = tuple(axis.quick_stop for axis in drives.axes)
        self._torques = any(axis.torque_offset for axis in drives.axes)
        self._boot = boot
        self._log = log
        self.feedbacks = Sent(boot)
        """When drive feedback was sent."""
        self._sequence = 0

    def offer(self, block: SetpointBlock, now: float) -> None:
        """A block from somebody who says to be the owner."""
        outcome = self.group.playout.offer(block)
        self.claims.sent(block, now, accepted=not isinstance(outcome, RefusedBlock))
        if isinstance(outcome, RefusedBlock):
            self._refused(block, outcome, now)

    def _refused(self, block: SetpointBlock, outcome: RefusedBlock, now: float) -> None:
        text = f"{self.name}: block {block.sequence} refused ({outcome.reason.value}): {outcome.text}"
        about = self.name, outcome.reason
        if outcome.reason in HARMLESS:
            remedy = "harmless when rare, else take load off the hosts"
            self._log.warn_of_many("block_refused", text, remedy, about, now, MANY)
        else:
            self._log.warn_repeated("block_refused", text, "the agent must go on from the feedback", about, now)

    def claim(self, call: Claim, now: float, tick: int) -> tuple[bool, str, ClaimGrant | None]:
        before = self.claims.owner
        at_rest = self.group.standstill.at_rest
        owner = self.claims.claim(call.boot, at_rest, now)
        if isinstance(owner, ClaimRefused):
            return False, owner.text if at_rest else f"{owner.text}{self.group.permits.moving()}", None
        if owner != before:
            self.group.playout.own(owner)
            self._log.info("claimed", f"{self.name} is claimed by boot {call.boot} as owner {owner}")
        grant = ClaimGrant(
            owner, self._settings.cycle_s, tick, self._axes, self._boot, self._torques, self.group.outputs.names,
            self.claims.epoch, self._quick_stop,
        )  # fmt: skip
        return True, f"{self.name} is yours as owner {owner}", grant

    def obey(self, call: Release | EnableDrives | DisableDrives | ResetDrives, now: float, then: Then) -> None:
        """Do what the owner asks; `then` gets the answer, at once or when the drives are there."""
        problem = self.claims.problem_of(call.owner)
        if problem:
            then(False, problem)
            return
        self.claims.alive(call.owner, now)
        match call:
            case Release():
                self._release(then)
            case EnableDrives():
                self.group.enable(now, then)
            case DisableDrives():
                self.group.disable(now, then)
            case ResetDrives():
                self.group.reset(now, then)

    def check_set_up(self, call: SetupCall, now: float) -> None:
        """Raise `SetupRefused` where a motion of the drives' own cannot be."""
        planned(self.group, call, now)

    def set_up(self, call: SetupCall, order: str, now: float) -> str:
        """A motion of the drives' own begins as soon as its operator holds it; answers which. Raises `SetupRefused`.

        `order` is the id of the call, by which it is held.
        """
        motion, nodes = planned(self.group, call, now)
        self.group.setup.begin(motion, order, nodes)
        self._log.info("setup", f"{motion.what} begins; it stops when its operator lets go")
        return f"{motion.what} begins"

    def hold(self, order: str, at: float) -> tuple[str, str]:
        """Whoever ordered the motion held it at `at` [s]: what goes on, for people and in one word."""
        motion, ended = self.group.setup.motion, self.group.setup.ended
        if order != self.group.setup.order:
            other = "another order moves it" if motion is not None else "it is not being set up by this order"
            return f"{self.name}: {other}", "stopped"
        if motion is not None:
            motion.hold(at)
            return motion.progress(), "moving"
        if ended is None:
            return f"{self.name} is not being set up", "stopped"
        return (f"stopped: {ended.problem}", "stopped") if ended.problem else (f"{ended.what} is done", "done")

    def accept(self, axes: Sequence[str]) -> tuple[bool, str]:
        """An operator says that these axes (none named: all) are where their drives show them."""
        problem = self.group.permits.accept()
        known = [node.axis.name for node in self.group.nodes]
        unknown = [name for name in axes if name not in known]
        if problem or unknown:
            return False, problem or f"{self.name} has no axis {unknown[0]}; its axes are {', '.join(known)}"
        chosen = [
            node for node in self.group.nodes if node.axis.name in axes or (not axes and not node.reference.known)
        ]
        found = {node.axis.name: (node.reference.why, node.reference.accept()) for node in chosen}
        refused = [f"{name} {why}" for name, (_, why) in found.items() if why]
        if refused or not found:
            return False, f"{self.name}: {'; '.join(refused) or 'every axis is referenced already'}"
        text = "; ".join(f"{name} ({why})" for name, (why, _) in found.items())
        self._log.info("accepted", f"{self.name}: an operator confirmed where it is: {text}")
        return True, f"{self.name} is where its drives say: {text}"

    def observe(self, now: float, tick: int, order: StopOrder | None) -> list[Effect]:
        """The first half of a cycle, after the SYNC numbered `tick`: what else must be done, after its `command`."""
        if not self.group.watch.measured:
            # Without feedback the owner has nothing to answer: its silence says nothing yet.
            self.claims.alive(self.claims.owner, now)
        elif self.claims.expire(self.group.standstill.at_rest, now):
            self.group.playout.own(0)
            self._log.warn("claim_ended", f"{self.name}: its owner fell silent", "start the robot's agent again")
        return self.group.observe(now, tick, order)

    def command(self, now: float, tick: int) -> Iterator[Effect]:
        """The second half: the RPDOs for the next SYNC, then the feedback."""
        before = self.group.commanded, self.group.outputs.on, self.group.outputs.played
        self.hand.step(now)
        yield from self.group.command(now)
        if self.group.watch.measured:
            feedback = self._feedback(tick, *before)
            self.feedbacks.record(feedback.sequence, now)
            yield Publish(feedback)

    def _release(self, then: Then) -> None:
        if not self.group.standstill.at_rest:
            then(False, f"{self.name} moves; release it at rest")
            return
        self.claims.end()
        self.group.playout.own(0)
        self._log.info("released", f"{self.name} was released by its owner")
        then(True, f"{self.name} is released")

    def _feedback(self, tick: int, commanded: Floats, outputs: int, event: int) -> DriveFeedback:
        group = self.group
        playout = group.playout
        self._sequence += 1
        return DriveFeedback(
            robot=self.name,
            boot=self._boot,
            sequence=self._sequence,
            tick=tick,
            owner=self.claims.owner,
            block=playout.block,
            state=playout.state,
            level=playout.level if playout.live else 0,
            refused=playout.refused,
            referenced=group.referenced,
            enabled=playout.live,
            position=group.watch.position,
            velocity=group.watch.velocity,
            commanded=commanded,
            axes=tuple(node.status for node in group.nodes),
            torque=group.watch.torque,
            outputs=outputs,
            event=event,
        )
