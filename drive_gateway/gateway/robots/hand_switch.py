"""Digital outputs that an operator switches: judged in the cycle that switches, answered when the drive shows it.

A program that runs rules the outputs, and nothing is switched while something moves the robot. A robot that stands may
be in a fault or switched off: somebody may have to free a person or a part. What is forced for a test is kept over all
that, but for what a stop switches off.
"""

from cell.messages import ForceOutput, SwitchOutput
from drive_gateway.canopen.sdo import Dialogue, SdoRead
from drive_gateway.config.settings import OutputSettings
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.drives.power import PowerState
from drive_gateway.gateway.event_log import EventLog
from drive_gateway.gateway.io.io_node import IoNode
from drive_gateway.gateway.robots.group import DriveGroup, Then

CONFIRM_S = 1.0
"""Within this time the drive must show what it was told."""


class HandSwitch:
    """The orders for the outputs of one robot."""

    def __init__(self, group: DriveGroup, log: EventLog) -> None:
        self._group = group
        self._log = log
        self._orders: list[tuple[SwitchOutput | ForceOutput, Then]] = []
        self._told: list[_Told] = []

    def order(self, order: SwitchOutput | ForceOutput, then: Then) -> None:
        """Do it in the next cycle, or say why not; `then` gets the answer."""
        self._orders.append((order, then))

    def step(self, now: float) -> None:
        """Before the sample of a cycle is handed out: what is switched here goes out with it."""
        if self._orders:
            orders, self._orders = self._orders, []
            for order, then in orders:
                self._obey(order, then, now)
        if self._told:
            self._told = [told for told in self._told if not told.answered(now)]

    def _obey(self, order: SwitchOutput | ForceOutput, then: Then, now: float) -> None:
        outputs = self._group.outputs
        output = outputs.named(order.output)
        if output is None:
            then(False, self._unknown(order.output))
            return
        carrier = self._group.carrier(output)
        if isinstance(order, ForceOutput) and order.on is None:
            outputs.follow(output.name)
            self._log.info("output_follows", f"{_what(order)} follows its program again, by {order.by}")
            then(True, f"{_what(order)} follows its program again, and is {_word(outputs.is_on(output.name))}")
            return
        on = bool(order.on)
        problem = self._problem(output, carrier, order)
        if problem:
            then(False, f"{order.robot}: {problem}")
            return
        if isinstance(order, ForceOutput):
            outputs.force(output.name, on, order.by)
            self._log.warn(
                "output_forced",
                f"{_what(order)} is forced {_word(on)}, by {order.by}",
                f"when the test is over: cell output {order.robot} {order.output} follow",
            )
        elif outputs.is_on(output.name) is not on:
            outputs.switch(output.name, on)
            self._log.info("output_by_hand", f"{_what(order)} was switched {_word(on)} by hand, by {order.by}")
        self._told.append(_Told(self._group, carrier, output, _what(order), on, then, now + CONFIRM_S))

    def _unknown(self, name: str) -> str:
        names = self._group.outputs.names
        known = f"its outputs are {', '.join(names)}" if names else "`outputs` of the drives file names none"
        return f"{self._group.robot} has no output {name}; {known}"

    def _problem(self, output: OutputSettings, carrier: Drive | IoNode, order: SwitchOutput | ForceOutput) -> str:
        """Why it must not be switched, or cannot be told; empty when it may."""
        group = self._group
        if not carrier.operational:
            return f"output {output.name} is at {carrier.said()}; it is told nothing before it is operational"
        if group.setup.motion is not None:
            return "it is being set up; switch outputs when that is done"
        if isinstance(order, SwitchOutput) and (why := self._ruled(output)):
            return why
        why = group.playout.why_stopped
        if order.on and not output.keep and why:
            return (
                f"output {output.name} has `at_stop: off` in the drives file, so it stays off while {why}; "
                "it can be switched on once the robot is enabled and its agent runs"
            )
        return ""

    def _ruled(self, output: OutputSettings) -> str:
        """Why an operator must not switch it without force; empty when he may."""
        group = self._group
        if forced := group.outputs.forced.get(output.name):
            on, by = forced
            follow = f"cell output {group.robot} {output.name} follow"
            return f"output {output.name} is forced {_word(on)}, by {by}; first: {follow}"
        if group.playout.programmed:
            return (
                f"its program runs and switches the outputs; first: cell halt {group.robot}, "
                "or where its agent is silent wait until that has lost its claim"
            )
        if group.power.state is PowerState.STOPPING:
            return f"its drives brake; switch output {output.name} when it stands"
        if group.playout.live and not group.standstill.at_rest:
            return f"it moves; switch output {output.name} when it stands"
        return ""


class _Told:
    """One output that was switched, until its drive shows it in 60FEh:01, or its I/O node in 6200h."""

    def __init__(
        self,
        group: DriveGroup,
        carrier: Drive | IoNode,
        output: OutputSettings,
        what: str,
        on: bool,
        then: Then,
        deadline: float,
    ) -> None:
        self._outputs = group.outputs
        self._carrier = carrier
        self._name = output.name
        self._what = what
        self._on = on
        self._then = then
        self._deadline = deadline
        self._confirmed = False
        self._found = "does not answer"
        # It goes out after the frame of this cycle and the SYNC with which that acts.
        self._reading = self._read(*carrier.output_object(output.bit))
        carrier.node.sdo.follow(self._reading)

    def answered(self, now: float) -> bool:
        """One cycle; true when the operator has the answer."""
        word = _word(self._on)
        if self._outputs.is_on(self._name) is not self._on:
            text = f"was switched {word}, and is {_word(not self._on)} again"
            self._then(False, f"{self._what} {text}: a stop, a program or another order came after")
        elif self._confirmed:
            self._then(True, f"{self._what} is {word}: {self._carrier.label} {self._found}")
        elif now > self._deadline:
            text = f"was told to be {word}, but not confirmed within {CONFIRM_S:g} s"
            look = "look what it does before you rely on it"
            self._then(False, f"{self._what} {text}: {self._carrier.label} {self._found}; {look}")
        else:
            return False
        self._reading.close()
        return True

    def _read(self, index: int, sub: int, bit: int) -> Dialogue:
        """The frame may have been lost; it is repeated."""
        name = f"{index:04X}h:{sub:02X}"
        while not self._confirmed:
            outcome = yield SdoRead(index, sub)
            if outcome.problem:
                self._found = f"does not tell {name}, {outcome.problem}"
                return
            shown = int.from_bytes(outcome.data, "little")
            self._found = f"shows {name} = {shown:0{2 * len(outcome.data)}X}h"
            self._confirmed = bool(shown >> bit & 1) is self._on


def _what(order: SwitchOutput | ForceOutput) -> str:
    return f"{order.robot}: output {order.output}"


def _word(on: bool) -> str:
    return "on" if on else "off"
