"""The agent's side of its gateway: the claim, the newest feedback, and when drives are switched."""

import math
from dataclasses import dataclass, replace

from cell.core import Ask, AskDone, Effect
from cell.messages import (
    Call,
    Claim,
    ClaimGrant,
    Command,
    DisableDrives,
    DriveFeedback,
    EnableDrives,
    Heard,
    Mode,
    Release,
    Reply,
)

_ASK_TIMEOUT_S = 3.0
"""So long one query waits; a call whose command takes longer is then repeated under its id, for a query may be lost."""
_CLAIM_AGAIN_S = 0.5
_RELEASE_S = 1.0
_OTHERS_S = 0.25
"""Only another gateway run is heard for so long: then a call must tell who lives."""


@dataclass(frozen=True, slots=True)
class Switching:
    """A call to the gateway on behalf of an operator's request."""

    request_id: str
    call_id: str
    command: Command
    call: Call
    """To the gateway."""
    tries: int
    """So often it may still be repeated."""


class GatewayLink:
    """Claims the robot, keeps the newest feedback, and passes operators' switching calls on."""

    def __init__(self, robot: str, boot: str, digest: str, gateway: str) -> None:
        self._to = f"gateway/{gateway}"
        self._claim = Claim(robot, boot, digest)
        self._asks = 0
        self._claim_ask: str | None = None
        self._release_ask: str | None = None
        self._release_until: float | None = None
        self._claim_due = -math.inf
        self._switching: dict[str, Switching] = {}
        self._again: list[Effect] = []
        """Calls to be repeated."""
        self._sequence = -1
        self._heard_at = -math.inf
        self._only_others_since: float | None = None
        self.grant: ClaimGrant | None = None
        self.refusal = ""
        """Why the newest claim brought nothing; empty while it is not known."""
        self.refused_by_gateway = False
        """Whether the gateway itself said no, as opposed to nobody answering."""
        self.feedback: DriveFeedback | None = None

    def heard(self, feedback: DriveFeedback, now: float) -> None:
        """Take the newest feedback of the gateway that gave the claim; if it knows another owner, the claim ends.

        What another run of the gateway says may be news of a restart, or late and of before. So it ends the claim only
        once nothing else is heard: the next claim is answered by the run that lives.
        """
        grant = self.grant
        if grant is None or not self._is_mine(feedback, now) or feedback.sequence <= self._sequence:
            return
        if feedback.tick > grant.tick and feedback.owner != grant.owner:
            self.lose_claim()
            return
        self.feedback, self._sequence = feedback, feedback.sequence
        self._heard_at = now

    def _is_mine(self, feedback: DriveFeedback, now: float) -> bool:
        grant = self.grant
        if grant is not None and feedback.boot == grant.gateway_boot:
            self._only_others_since = None
            return len(feedback.axes) == len(grant.axes)
        if self._only_others_since is None:
            self._only_others_since = now
        elif now - self._only_others_since > _OTHERS_S:
            self.lose_claim()
        return False

    def age(self, now: float) -> float:
        """Seconds since the newest feedback; infinite when none came."""
        return now - self._heard_at

    @property
    def owned(self) -> DriveFeedback | None:
        """The newest feedback, when it says that this agent owns the robot."""
        if self.grant is None or self.feedback is None or self.feedback.owner != self.grant.owner:
            return None
        return self.feedback

    def lose_claim(self) -> None:
        self.grant = None
        self.feedback = None
        self._sequence, self._only_others_since = -1, None

    def claim_if_due(self, now: float) -> list[Effect]:
        """Ask for the robot until the gateway says yes, and again what had no answer yet."""
        again, self._again = self._again, []
        if self.grant is not None or self._claim_ask is not None or now < self._claim_due:
            return again
        self._claim_due = now + _CLAIM_AGAIN_S
        ask = self._ask(self._claim)
        self._claim_ask = ask.ask_id
        return [*again, ask]

    def release(self, now: float) -> list[Effect]:
        """Give the robot back; to be called until `released`.

        A gateway refuses while it still measures a motion, so the robot is offered again for a second. Later the claim
        ends by the gateway's own deadline.
        """
        if self._release_until is None:
            self._release_until = now + _RELEASE_S
        if now > self._release_until:
            self.lose_claim()
        if self.grant is None or self._release_ask is not None:
            return []
        ask = self._ask(Release(self._claim.robot, self.grant.owner), _RELEASE_S)
        self._release_ask = ask.ask_id
        return [ask]

    @property
    def released(self) -> bool:
        """Whether this agent owns nothing, and has nothing to wait for."""
        return self.grant is None

    def switch(self, command: Command, request_id: str = "", call_id: str = "") -> Effect:
        """Ask the gateway to switch the drives, for an operator's request if there is one."""
        call = self._call(command)
        ask = Ask(call.id, self._to, call, _ASK_TIMEOUT_S)
        tries = math.ceil(command.answer_within_s / _ASK_TIMEOUT_S) - 1
        self._switching[ask.ask_id] = Switching(request_id, call_id, command, call, tries)
        return ask

    @property
    def switching_off(self) -> bool:
        """Whether a call to switch the drives off is under way."""
        return any(isinstance(switching.command, DisableDrives) for switching in self._switching.values())

    @property
    def switching_on(self) -> bool:
        """Whether a call to switch the drives on is under way."""
        return any(isinstance(switching.command, EnableDrives) for switching in self._switching.values())

    def done(self, outcome: AskDone) -> tuple[Switching, bool, str] | None:
        """Take an outcome; for a switching call return it, whether it worked, and what the gateway said."""
        reply = outcome.reply if isinstance(outcome.reply, Reply) else None
        text = reply.text if reply is not None else outcome.problem
        if outcome.ask_id == self._claim_ask:
            self._claim_ask = None
            self.refusal = "" if reply is not None and reply.ok else text
            self.refused_by_gateway = reply is not None and not reply.ok
            if reply is not None and reply.ok:
                self.grant = reply.claim
            return None
        if outcome.ask_id == self._release_ask:
            self._release_ask = None
            if reply is None or reply.ok:
                self.lose_claim()
        switching = self._switching.pop(outcome.ask_id, None)
        if switching is None:
            return None
        if reply is None and switching.tries and self.grant is not None:
            self._asks += 1
            ask = Ask(f"{switching.call.id}-{self._asks}", self._to, switching.call, _ASK_TIMEOUT_S)
            self._switching[ask.ask_id] = replace(switching, tries=switching.tries - 1)
            self._again.append(ask)
            return None
        return switching, reply is not None and reply.ok, text

    def _ask(self, command: Command, timeout_s: float = _ASK_TIMEOUT_S) -> Ask:
        call = self._call(command)
        return Ask(call.id, self._to, call, timeout_s)

    def _call(self, command: Command) -> Call:
        self._asks += 1
        seen = self.feedback
        heard = None if seen is None else Heard(seen.boot, seen.sequence)
        return Call(f"{self._claim.robot}-{self._claim.boot}-{self._asks}", command, heard)


class IdleClock:
    """When a robot that nobody uses is switched off: torque only while it is needed.

    Time without a program counts; a program that waits or is halted is in use. `after_s` `None`: never.
    """

    def __init__(self, after_s: float | None) -> None:
        self._after_s = after_s
        self._since: float | None = None

    def due(self, mode: Mode, now: float) -> bool:
        """True once, when the robot has been ready for that long."""
        if self._after_s is None or mode is not Mode.READY:
            self._since = None
            return False
        if self._since is None:
            self._since = now
        if now - self._since < self._after_s:
            return False
        self._since = now
        return True
