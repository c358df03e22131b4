"""Calls and their replies: a call that is repeated is answered again and not done again."""

from cell.core import Answer, Effect
from cell.messages import Call, ClaimGrant, Reply

REMEMBERED_S = 5.0
"""How long a reply is kept for a repeated call."""


class Replies:
    """Requests that wait and replies that were given, by the call's id."""

    def __init__(self) -> None:
        self._waiting: dict[str, list[str]] = {}
        self._given: dict[str, tuple[float, Reply]] = {}
        self._effects: list[Effect] = []
        self._now = 0.0

    def opened(self, request_id: str, call: Call) -> bool:
        """Note a request; true when its call is new and must be done."""
        given = self._given.get(call.id)
        if given is not None:
            self._effects.append(Answer(request_id, given[1]))
            return False
        waiting = self._waiting.setdefault(call.id, [])
        waiting.append(request_id)
        return len(waiting) == 1

    def give(self, call_id: str, ok: bool, text: str, claim: ClaimGrant | None = None, data: str = "") -> None:
        """Answer a call, whoever asked it how often."""
        reply = Reply(call_id, ok, text, claim, data)
        self._given[call_id] = (self._now, reply)
        self._effects += [Answer(request_id, reply) for request_id in self._waiting.pop(call_id, [])]

    def take(self, now: float) -> list[Effect]:
        """The answers to send, once per cycle; old replies are forgotten."""
        self._now = now
        for call_id in [call_id for call_id, (at, _) in self._given.items() if now - at > REMEMBERED_S]:
            del self._given[call_id]
        effects, self._effects = self._effects, []
        return effects
