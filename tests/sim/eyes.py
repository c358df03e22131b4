"""What one operator has heard of the cell, through a session like that of the commands."""

from cell.messages import Event, GatewayState, Heard, ManagerState, Presence, RobotState
from tests.sim.exchange import SimSession


class Eyes:
    """The newest states that this operator heard, watched as `CellView` of `cell.commands` does; and all events."""

    def __init__(self, session: SimSession) -> None:
        self.session = session
        self._states = session.watch("robot/*/state", "robot/*/presence", "gateway/*/state", "manager/state")
        self._events = session.queue("event/**")
        self._robots: dict[str, RobotState] = {}
        self._presences: dict[str, Presence] = {}
        self._gateways: dict[str, GatewayState] = {}
        self._manager: ManagerState | None = None

    @property
    def robots(self) -> dict[str, RobotState]:
        self._look()
        return self._robots

    @property
    def presences(self) -> dict[str, Presence]:
        self._look()
        return self._presences

    @property
    def gateways(self) -> dict[str, GatewayState]:
        self._look()
        return self._gateways

    @property
    def manager(self) -> ManagerState | None:
        self._look()
        return self._manager

    def events(self) -> list[Event]:
        """Events since the last look at them."""
        self.session.take_in()
        return [event for event in self._events.take() if isinstance(event, Event)]

    def heard(self, to: str) -> Heard | None:
        """The echo for a call to a process."""
        role, _, name = to.partition("/")
        state: RobotState | GatewayState | ManagerState | None
        if role == "manager":
            state = self.manager
        else:
            state = self.robots.get(name) if role == "robot" else self.gateways.get(name)
        return Heard(state.boot, state.sequence) if state is not None else None

    def _look(self) -> None:
        self.session.take_in()
        for message in self._states.take_new():
            match message:
                case RobotState():
                    self._robots[message.robot] = message
                case Presence():
                    self._presences[message.robot] = message
                case GatewayState():
                    self._gateways[message.gateway] = message
                case ManagerState():
                    self._manager = message
