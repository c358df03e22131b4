"""The drives of one robot in the cycle: measure, look for troubles, go on with power, command the next sample."""

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from cell.core import Effect
from cell.messages.drives import AxisStatus, PlayoutState
from drive_gateway.cia402.units import AxisUnits
from drive_gateway.config.settings import GatewaySettings, OutputSettings, RobotDrives
from drive_gateway.gateway.drives.drive import Drive, drives_of
from drive_gateway.gateway.drives.output_frames import OutputFrames
from drive_gateway.gateway.drives.position_keeper import PositionKeeper
from drive_gateway.gateway.drives.power import Power, PowerState
from drive_gateway.gateway.effects import Frame
from drive_gateway.gateway.event_log import EventLog
from drive_gateway.gateway.io.io_node import IoNode
from drive_gateway.gateway.io.named_inputs import NamedInputs
from drive_gateway.gateway.playout.outputs import Outputs
from drive_gateway.gateway.playout.playout import Playout
from drive_gateway.gateway.reference.encoder_record import EncoderRecord
from drive_gateway.gateway.reference.reference import Reference
from drive_gateway.gateway.robots.permits import Permits, StopOrder
from drive_gateway.gateway.robots.standstill import Standstill
from drive_gateway.gateway.setup.setup_desk import SetupDesk
from drive_gateway.gateway.trouble import HARD_WIRED, Trouble
from drive_gateway.gateway.watch.brake_watch import BrakeWatch
from drive_gateway.gateway.watch.inputs import InputKind, open_inputs
from drive_gateway.gateway.watch.measurement import Floats
from drive_gateway.gateway.watch.sent_samples import SentSamples
from drive_gateway.gateway.watch.stop_watch import StopWatch
from drive_gateway.gateway.watch.watch import Watch

Then = Callable[[bool, str], None]
"""Takes whether it was done, and what was done or found."""


class DriveGroup:
    """All drives of one robot. What is asked for is answered through `Then`, at once or when the drives have it."""

    def __init__(
        self,
        drives: RobotDrives,
        settings: GatewaySettings,
        log: EventLog,
        stored: Mapping[str, EncoderRecord],
        io_nodes: Mapping[str, IoNode],
    ) -> None:
        axes = drives.axes
        self.robot = drives.robot
        references = [Reference(axis, stored.get(f"{drives.robot}.{axis.name}")) for axis in axes]
        self.outputs = Outputs(drives.outputs, settings.cycle_s)
        self.nodes = drives_of(drives.robot, axes, settings, references, self.outputs)
        self._output_frames = OutputFrames(self.nodes, self.outputs)
        self._stations = tuple(dict.fromkeys(drive.node for drive in self.nodes))
        self.power = Power(self.nodes)
        self.watch = Watch(self.nodes, self.power, settings, log)
        # The first cycle sends SYNC 1 and then the sample of tick 2.
        self.playout = Playout(axes, settings.cycle_s, self.watch.position, tick=1, outputs=self.outputs)
        self.setup = SetupDesk(log)
        self._keeper = PositionKeeper(self.robot, self.nodes)
        self.standstill = Standstill(self.nodes, self.power, self.watch, self.playout, self.setup)
        self._stop_watch = StopWatch(self.nodes)
        self._brake_watch = BrakeWatch(self.nodes)
        used = [*(output.io for output in drives.outputs), *(item.io for item in drives.inputs)]
        self.io_nodes = tuple(io for name, io in io_nodes.items() if name in used)
        """Those that have an input or output of this robot."""
        for io in self.io_nodes:
            io.serve(self.robot, self.outputs)
        self.inputs = NamedInputs(drives.inputs, self.nodes, io_nodes)
        needed = [io for io in self.io_nodes if io.io.stops]
        self.permits = Permits(self.robot, self.nodes, self.power, self.watch, self.setup, needed)
        self._log = log
        self._units = AxisUnits(axes)
        self._window: Floats = np.array([axis.following_window for axis in axes])
        self._sent = SentSamples(self.watch.position, [axis.delay_cycles for axis in axes])
        self._then: Then | None = None

    def carrier(self, output: OutputSettings) -> Drive | IoNode:
        """Who has an output of this robot."""
        if output.io:
            return next(io for io in self.io_nodes if io.io.name == output.io)
        return next(drive for drive in self.nodes if drive.axis.name == output.axis)

    @property
    def operational(self) -> bool:
        return all(node.operational for node in self.nodes)

    @property
    def referenced(self) -> bool:
        """Every axis knows where it is, and none moves by itself."""
        return self.operational and self.setup.motion is None and all(node.reference.known for node in self.nodes)

    @property
    def commanded(self) -> Floats:
        """`(n,)` [rad or m] the sample of the present tick."""
        return self._sent.newest

    def enable(self, now: float, then: Then) -> None:
        """Switch on; the robot holds the position that is measured."""
        match self.power.state:
            case PowerState.ON:
                then(True, f"{self.robot} is enabled already")
            case _ if problem := self.permits.enable():
                then(False, problem)
            case _:
                self._then = then
                self.power.enter(PowerState.SWITCHING_ON, now)

    def disable(self, now: float, then: Then) -> None:
        """Switch off, only at rest: a drive that loses its torque in motion runs out uncontrolled."""
        match self.power.state:
            case PowerState.OFF if self.setup.motion is not None:
                self.setup.stop("it was disabled", now)
                then(True, f"{self.robot} stops its set-up motion and switches off")
            case PowerState.OFF:
                then(True, f"{self.robot} is off already")
            case PowerState.FAULT if problem := self.permits.restless():
                then(False, problem)
            case PowerState.FAULT:
                self.power.released = True
                then(True, f"{self.robot} is in fault and loses its voltage: {self.permits.cause()}")
            case PowerState.ON if self.standstill.at_rest:
                self._then = then
                self._switch_off(now)
            case PowerState.ON:
                then(False, f"{self.robot} moves; halt it first")
            case _:
                then(False, self.permits.busy())

    def reset(self, now: float, then: Then) -> None:
        """Acknowledge a fault, only at rest. Nothing moves and nothing is enabled by this."""
        match self.power.state:
            case PowerState.FAULT if problem := self.permits.restless():
                then(False, problem)
            case PowerState.FAULT:
                self._then = then
                self.power.enter(PowerState.RESETTING, now)
            case PowerState.OFF | PowerState.ON:
                then(True, f"no drive of {self.robot} reports a fault")
            case _:
                then(False, self.permits.busy())

    def fault(self, trouble: Trouble, now: float) -> None:
        """Stop all drives of the robot with voltage on; nothing moves again before reset and enable."""
        if trouble.again and self.power.state is PowerState.RESETTING:
            # Errors go one after another; a drive that keeps one stays in its fault, and the reset ends by its time.
            return
        stopped = self.power.state in (PowerState.STOPPING, PowerState.FAULT)
        self._log.alarm(trouble, self.robot, now, anew=not stopped)
        if stopped:
            self.permits.trouble = trouble.instead_of(self.permits.trouble)
            return
        self.permits.trouble = trouble
        self._answer(False, f"{self.robot}: {trouble.text}; {trouble.remedy}")
        if self.power.state is PowerState.OFF and self.standstill.at_rest:
            self._stand_in_fault(now)
        else:
            self.setup.abandon(f"{trouble.text}; {trouble.remedy}", now)
            self._quick_stop(now)

    def observe(self, now: float, tick: int, order: StopOrder | None) -> list[Effect]:
        """After the SYNC numbered `tick`: measure, judge and decide; what the nodes need, after the RPDOs."""
        self.permits.order = order
        self.outputs.barred = "" if order is None else order.reason
        after = [effect for node in self._stations for effect in node.step(now, tick - 1)]
        self.watch.measure(now)
        for trouble in self.watch.troubles(self._sent.answered, now):
            self.fault(trouble, now)
        self._mind_rest(now)
        self._mind_inputs(now)
        self.power.step(now)
        self._progress(now)
        for trouble in self.setup.step(now):
            self.fault(trouble, now)
        if order is not None:
            self._obey(order, now)
        return [*after, *self._keeper.step(self.standstill.secured, now)]

    def command(self, now: float) -> Iterator[Effect]:
        """The RPDOs for the next SYNC."""
        position, velocity = self.playout.advance()
        self._sent.add(position)
        counts = self._units.counts(position)
        speeds = self._units.speeds(velocity)
        torques = self._units.per_mille(self.playout.torque)
        for node, count, speed, torque in zip(self.nodes, counts, speeds, torques, strict=True):
            if node.addressed:
                frames = self.setup.command(node, torque, now)
                if frames is None:
                    frames = node.command(self.power.controlword(node), count, speed, torque)
                for frame in frames:
                    yield Frame(frame)
        for frame in self._output_frames.due(now):
            yield Frame(frame)
        for name, why in self.outputs.take_stopped():
            text = f"{self.robot}: output {name} was switched off, because {why}"
            self._log.warn("output_off", text, "the program must switch it on again where it needs it")

    # Power

    def _mind_rest(self, now: float) -> None:
        """Axes that should stand must come to rest; in `ON` it is the following error that is watched."""
        for trouble in self._brake_watch.step(self.power.state is PowerState.OFF):
            self._log.alarm(trouble, self.robot, now, anew=False)
        if self.watch.standing or self.power.stoppable:
            self._stop_watch.forget()
            return
        for trouble in self._stop_watch.step(self._must_stand, now):
            self.fault(trouble, now)

    def _must_stand(self, drive: Drive) -> bool:
        """Nothing wants a motion of it any more: it was told to stop, or it has torque for no reason."""
        if self.power.state in (PowerState.STOPPING, PowerState.FAULT):
            return True
        return not (drive.without_torque or self.setup.wants(drive))

    def _mind_inputs(self, now: float) -> None:
        """A safety input that opens stops the robot; voltage goes when it stands, and does not return by itself."""
        self.permits.inputs = tuple(open_inputs(self.nodes, now))
        if not self.permits.inputs:
            return
        # A button that is heard stops the whole cell (`EstopButtons`), and this robot on its path first.
        found = [item for item in self.permits.inputs if not (item.kind is InputKind.ESTOP and item.heard)]
        if found and (self.power.stoppable or self.setup.motion is not None):
            self.fault(found[0].trouble, now)
        if self.power.state is PowerState.FAULT and self.watch.standing:
            self.power.released = True

    def _progress(self, now: float) -> None:
        """What follows from where the drives have arrived."""
        match self.power.state:
            case PowerState.OFF:
                self._answer_if_waiting()
                if self.watch.measured:
                    self.playout.follow(self.watch.position)
            case PowerState.SWITCHING_ON:
                self.playout.follow(self.watch.position)
                if self.power.all_in(AxisStatus.SWITCHED_ON):
                    self.power.hand_over(self._units.counts(self.watch.position), now)
            case PowerState.HANDING_OVER | PowerState.ENABLING if self._moved():
                self._answer(False, f"{self.robot} moved while it was enabled; check brakes and loads")
                self._switch_off(now)
            case PowerState.ON if self.playout.state is PlayoutState.FOLLOWING:
                self.playout.go_live()
                self._log.info("enabled", f"{self.robot} is enabled")
                self._answer(True, f"{self.robot} is enabled: {len(self.nodes)} drives hold their position")
            case PowerState.STOPPING if self.watch.standing:
                self._after_stop(now)
        if self.power.late(now):
            self._too_late(now)

    def _answer_if_waiting(self) -> None:
        if self._then is not None:
            self.permits.trouble = None
            self._log.info("disabled", f"{self.robot} is off")
            self._answer(True, f"{self.robot} is off: {len(self.nodes)} drives without torque")

    def _moved(self) -> bool:
        """An axis left the position that was taken over as its target."""
        return bool((np.abs(self.watch.position - self.playout.position) > self._window).any())

    def _after_stop(self, now: float) -> None:
        if self.permits.trouble is None:
            self._switch_off(now)
        else:
            self._stand_in_fault(now)

    def _too_late(self, now: float) -> None:
        state = self.power.state
        found = self.permits.said()
        if state is PowerState.RESETTING:
            restless = self.permits.restless()
            self.power.enter(PowerState.FAULT, now)
            text = f"{self.robot} could not be reset, a cause is still there: {found}"
            self._answer(False, restless or text)
        elif state is PowerState.SWITCHING_OFF:
            text = f"the drives did not switch off: {found}"
            self.fault(Trouble("not_off", text, HARD_WIRED), now)
            for node in self.nodes:
                if node.operational and not node.without_torque:
                    node.stop_by_network(now)
        else:
            self._answer(
                False,
                f"{self.robot} got no further than {state.value}: {found}; look at what the drive needs for it, or "
                "give it more time by switch_on_s in the drives file",
            )
            self._switch_off(now)

    def _obey(self, order: StopOrder, now: float) -> None:
        self.setup.stop(order.reason, now)
        match self.power.state:
            case PowerState.SWITCHING_ON | PowerState.HANDING_OVER | PowerState.ENABLING:
                self._answer(False, f"{self.robot} stays off: {order.reason}")
                self._switch_off(now)
            case PowerState.ON if self.standstill.at_rest:
                self._switch_off(now)
            case PowerState.ON if now >= order.deadline:
                text = f"{self.robot} is not at rest in time ({order.reason}): quick stop"
                self._log.warn("stop_deadline", text, "look why the agent did not brake")
                self._quick_stop(now)
            case PowerState.FAULT if self.watch.standing:
                self.power.released = True

    def _switch_off(self, now: float) -> None:
        self.playout.follow(self.playout.position)
        self.power.enter(PowerState.SWITCHING_OFF, now)

    def _quick_stop(self, now: float) -> None:
        self.playout.stop()
        self.watch.forget_rest()
        self.power.enter(PowerState.STOPPING, now)

    def _stand_in_fault(self, now: float) -> None:
        self.playout.fail()
        self.power.enter(PowerState.FAULT, now)

    def _answer(self, ok: bool, text: str) -> None:
        then, self._then = self._then, None
        if then is not None:
            then(ok, text)
