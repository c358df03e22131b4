"""The events of a gateway, numbered in one sequence, and how often they are told that come again and again."""

from collections.abc import Hashable
from dataclasses import dataclass, replace
from math import inf

from cell.core import Effect, Publish
from cell.messages.event import Event, Severity
from drive_gateway.gateway.trouble import Trouble

TELL_S = 10.0
"""What comes again meanwhile is counted, and told once more with that number when this time is over."""
MOST_KINDS = 64
"""Told apart by what they are about; what comes on top of these is told apart by its code only."""
Data = dict[str, str | int | float | None]


@dataclass(slots=True)
class _Repeated:
    until: float
    newest: Event
    many: float = inf
    times: int = 0


class EventLog:
    """Collects what people should know until the core publishes it.

    What others send may come in each cycle, and is then told with its number of times. What is dangerous is told each
    time.
    """

    def __init__(self, gateway: str, boot: str) -> None:
        self._source, self._boot = f"gateway/{gateway}", boot
        self._sequence = 0
        self._waiting: list[Effect] = []
        self._repeated: dict[Hashable, _Repeated] = {}

    def info(self, code: str, text: str) -> None:
        self._say(self._event(Severity.INFO, code, text, "", {}))

    def warn(self, code: str, text: str, remedy: str) -> None:
        self._say(self._event(Severity.WARNING, code, text, remedy, {}))

    def warn_repeated(self, code: str, text: str, remedy: str, about: Hashable, now: float) -> None:
        """A warning that may come in each cycle; `about` tells apart what has the same code."""
        self._say_repeated(self._event(Severity.WARNING, code, text, remedy, {}), about, now)

    def warn_of_many(self, code: str, text: str, remedy: str, about: Hashable, now: float, many: int) -> None:
        """What is harmless when it is rare; `many` of it within `TELL_S` are a warning."""
        self._say_repeated(self._event(Severity.INFO, code, text, remedy, {}), about, now, many)

    def alarm(self, trouble: Trouble, robot: str, now: float, anew: bool = True) -> None:
        """A trouble of a robot's drives; `anew`: the robot had none, so this one is told in any case."""
        data: Data = {"robot": robot}
        if trouble.node_id is not None:
            data["node_id"] = trouble.node_id
        if trouble.emergency_code is not None:
            data["emergency_code"] = trouble.emergency_code
        event = self._event(Severity.ALARM, trouble.code, f"{robot}: {trouble.text}", trouble.remedy, data)
        if not trouble.repeats:
            self._say(event)
            return
        if anew:
            self._repeated.pop((trouble.code, event.text), None)
        self._say_repeated(event, event.text, now)

    def take(self, now: float) -> list[Effect]:
        if self._repeated:
            self._tell_numbers(now)
        effects, self._waiting = self._waiting, []
        return effects

    def _say_repeated(self, event: Event, about: Hashable, now: float, many: float = inf) -> None:
        key: Hashable = (event.code, about)
        if key not in self._repeated and len(self._repeated) >= MOST_KINDS:
            key = event.code
        before = self._repeated.get(key)
        if before is None:
            self._repeated[key] = _Repeated(now + TELL_S, event, many)
            self._say(event)
        else:
            before.newest = event
            before.times += 1

    def _tell_numbers(self, now: float) -> None:
        for key, repeated in [item for item in self._repeated.items() if now >= item[1].until]:
            if not repeated.times:
                del self._repeated[key]
                continue
            text = f"{repeated.newest.text} ({repeated.times} times more in {TELL_S:g} s)"
            severity = Severity.WARNING if repeated.times >= repeated.many else repeated.newest.severity
            self._say(replace(repeated.newest, text=text, severity=severity))
            self._repeated[key] = _Repeated(now + TELL_S, repeated.newest, repeated.many)

    def _event(self, severity: Severity, code: str, text: str, remedy: str, data: Data) -> Event:
        return Event(self._source, 0, severity, code, text, remedy, data, self._boot)

    def _say(self, event: Event) -> None:
        self._sequence += 1
        self._waiting.append(Publish(replace(event, sequence=self._sequence)))
