"""The events of a gateway, numbered in one sequence."""

from cell.core import Effect, Publish
from cell.messages.event import Event, Severity
from drive_gateway.gateway.trouble import Trouble


class EventLog:
    """Collects what people should know until the core publishes it."""

    def __init__(self, gateway: str, boot: str) -> None:
        self._source, self._boot = f"gateway/{gateway}", boot
        self._sequence = 0
        self._waiting: list[Effect] = []

    def info(self, code: str, text: str) -> None:
        self._say(Severity.INFO, code, text, "", {})

    def warn(self, code: str, text: str, remedy: str) -> None:
        self._say(Severity.WARNING, code, text, remedy, {})

    def alarm(self, trouble: Trouble, robot: str) -> None:
        """A trouble of a robot's drives."""
        data: dict[str, str | int | float | None] = {"robot": robot}
        if trouble.node_id is not None:
            data["node_id"] = trouble.node_id
        if trouble.emergency_code is not None:
            data["emergency_code"] = trouble.emergency_code
        self._say(Severity.ALARM, trouble.code, f"{robot}: {trouble.text}", trouble.remedy, data)

    def take(self) -> list[Effect]:
        effects, self._waiting = self._waiting, []
        return effects

    def _say(
        self, severity: Severity, code: str, text: str, remedy: str, data: dict[str, str | int | float | None]
    ) -> None:
        self._sequence += 1
        event = Event(self._source, self._sequence, severity, code, text, remedy, data, self._boot)
        self._waiting.append(Publish(event))
