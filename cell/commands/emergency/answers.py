"""What comes back through all doors of a cell: who stands under the stop, and what the manager says."""

import json
from threading import Lock

import zenoh

_PRESENCE_MAGIC, _HEAD_AT = b"ZPR3", 18
"""The fields of a presence are a JSON object after 18 bytes, which begin with the magic and its length (u32)."""
Member = tuple[str, str, str]
"""Cell, role and name of a process."""


class Answers:
    """Filled by Zenoh's threads, read by the one that tells."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._newest: dict[str, bytes] = {}
        self._open_calls = 0
        self._called = False
        self._said = ""
        self._refused = "nobody answers"

    def state(self, sample: zenoh.Sample) -> None:
        """A presence or a gateway's state."""
        with self._lock:
            self._newest[str(sample.key_expr)] = sample.payload.to_bytes()

    def asked(self) -> None:
        """A manager is asked; `no_more` follows when that call is over."""
        with self._lock:
            self._open_calls += 1
            self._called = True

    def reply(self, reply: zenoh.Reply) -> None:
        """A manager's reply, or that there is none."""
        if reply.ok is None:
            if reply.err is not None:
                self._refused = reply.err.payload.to_bytes().decode("utf-8", "replace")
            return
        found = _fields(reply.ok.payload.to_bytes())
        text = found.get("text")
        if not isinstance(text, str):
            self._refused = "its answer cannot be read"
        elif found.get("ok") is True:
            self._said = text
        else:
            self._refused = text

    def no_more(self) -> None:
        """A call is over."""
        with self._lock:
            self._open_calls -= 1

    @property
    def latched(self) -> bool:
        """A manager has latched the stop."""
        return bool(self._said)

    @property
    def manager(self) -> tuple[bool, str] | None:
        """Whether a manager has latched the stop, and its words; None as long as nobody knows."""
        if self._said:
            return True, self._said
        return (False, self._refused) if self._called and not self._open_calls else None

    def standing(self) -> set[Member]:
        """Who stands under a stop by what was heard since the last look."""
        with self._lock:
            newest, self._newest = self._newest, {}
        found: set[Member] = set()
        for key, data in newest.items():
            fields = _fields(data)
            if any(fields.get(stop) is not None for stop in ("estop_acknowledged", "estop_confirmed")):
                _, cell, role, name, _ = key.split("/")
                found.add((cell, role, name))
        return found


def _fields(data: bytes) -> dict[str, object]:
    """Of a message that anybody may have sent; empty when it cannot be read."""
    if data[:4] == _PRESENCE_MAGIC:
        data = data[_HEAD_AT : _HEAD_AT + int.from_bytes(data[4:8], "little")]
    try:
        found = json.loads(data)
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}
