"""Numbers that only ever grow."""

from cell.messages import DriveFeedback, Event, GatewayState, ManagerState, Presence, RobotState, Token
from tests.sim.judge.facts import Facts
from tests.sim.judge.invariant import Handlers, Invariant


class TokensGrow(Invariant):
    """A new token is greater than every one before it, also after a restart."""

    name = "tokens grow"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._known: set[Token] = set()
        self._largest: Token | None = None
        self._epochs: dict[str, int] = {}

    @property
    def published(self) -> Handlers:
        return {ManagerState: self._state}

    def _state(self, name: str, state: ManagerState) -> None:
        if state.boot not in self._epochs:
            if any(epoch >= state.epoch for epoch in self._epochs.values()):
                self.broken(name, f"epoch {state.epoch} after {max(self._epochs.values())}")
            self._epochs[state.boot] = state.epoch
        new = {zone.token for zone in state.zones.values() if zone.token is not None} - self._known
        for token in sorted(new):
            if self._largest is not None and token < self._largest:
                self.broken(name, f"token {token} after {self._largest}")
            self._largest = token
        self._known |= new


class SequencesGrow(Invariant):
    """Each sender counts its messages by one."""

    name = "sequences grow"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._newest: dict[tuple[type, str, str], int] = {}

    @property
    def published(self) -> Handlers:
        return dict.fromkeys((DriveFeedback, GatewayState, ManagerState, Presence, RobotState), self._message)

    def _message(self, name: str, message: DriveFeedback | GatewayState | ManagerState | Presence | RobotState) -> None:
        whose = message.robot if isinstance(message, DriveFeedback) else name
        key = type(message), whose, message.boot
        before = self._newest.get(key, message.sequence - 1)
        self._newest[key] = message.sequence
        if message.sequence != before + 1:
            self.broken(name, f"{type(message).__name__} {message.sequence} after {before}")


class EchoesGrow(Invariant):
    """What a process repeats of another's messages is never older than what it repeated before."""

    name = "echoes grow"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._newest: dict[tuple[str, str], tuple[int, int]] = {}

    @property
    def published(self) -> Handlers:
        return {Presence: self._presence, ManagerState: self._state}

    def _presence(self, name: str, presence: Presence) -> None:
        if presence.heard is not None:
            self._echo(name, presence.boot, "manager", presence.heard.boot, presence.heard.sequence)

    def _state(self, name: str, state: ManagerState) -> None:
        for robot, heard in state.heard.items():
            self._echo(name, state.boot, robot, heard.boot, heard.sequence)

    def _echo(self, name: str, boot: str, other: str, other_boot: str, sequence: int) -> None:
        if (other_boot, sequence) not in self.facts.sent:
            return  # a false presence
        echo = self.facts.rank(other_boot), sequence
        before = self._newest.get((boot, other), echo)
        self._newest[boot, other] = echo
        if echo < before:
            self.broken(name, f"it repeats {sequence} of {other_boot} after it repeated a newer one")


class JournalIsMended(Invariant):
    """A manager says that its journal is written again only after it has said that it cannot be written."""

    name = "a journal that is mended was broken"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._failing = ""
        """The boot of the manager that has said so last."""

    @property
    def published(self) -> Handlers:
        return {Event: self._event}

    def _event(self, name: str, event: Event) -> None:
        if event.code == "journal_failed":
            self._failing = event.boot
        elif event.code == "journal_written":
            if self._failing != event.boot:
                self.broken(name, f"{event.text}; it has not said that something was missing")
            self._failing = ""
