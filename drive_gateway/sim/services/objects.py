"""The values of one node's object dictionary, the checks before each change and what follows from it."""

from collections.abc import Callable, Iterator, MutableMapping
from dataclasses import dataclass
from typing import TypeVar

from drive_gateway.canopen.axis_objects import first_axis_index
from drive_gateway.canopen.sdo import SAVE
from drive_gateway.sim.services.abort import Abort, AccessRefused
from drive_gateway.sim.services.dictionary import Dictionary, Entry, axis_key, key_of

COMMUNICATION = range(0x1000, 0x2000)
"""Indices of the communication profile; NMT reset communication restores these only."""
ALL = range(0x10000)
PROCESS_DATA = (0x6040, 0x6060, 0x6071, 0x607A, 0x60B1, 0x60B2, 0x60C1, 0x60FE, 0x60FF)
"""What a master commands while it moves the axis; never stored."""
_SAVE_ALL = key_of(0x1010, 1)
_SAVES_ON_COMMAND = 1
"""What 1010h:01 shows: the node stores nothing by itself."""


V = TypeVar("V")


class _Shifted(MutableMapping[int, V]):
    """The part of a mapping that belongs to one axis, by the keys of axis 1."""

    def __init__(self, whole: dict[int, V], axis: int) -> None:
        self._whole = whole
        self._shift = axis_key(0, axis)

    def __getitem__(self, key: int) -> V:
        return self._whole[key + self._shift]

    def __setitem__(self, key: int, value: V) -> None:
        self._whole[key + self._shift] = value

    def __delitem__(self, key: int) -> None:
        del self._whole[key + self._shift]

    def __iter__(self) -> Iterator[int]:
        return (key - self._shift for key in self._whole)

    def __len__(self) -> int:
        return len(self._whole)


@dataclass(frozen=True, slots=True)
class AxisObjects:
    """The objects of one axis, by the keys of axis 1."""

    numbers: MutableMapping[int, int]
    guards: MutableMapping[int, Callable[[int], None]]
    followers: MutableMapping[int, Callable[[int], None]]


class Objects:
    """Values by key. The owner of an object registers its guard and its follower.

    A guard takes the value that is about to be stored and raises `AccessRefused`; a follower takes the stored one.
    Values come by SDO (`write`) and by PDO (`put`) through the same checks. Texts are constant; domains have neither
    guards nor followers.
    """

    def __init__(self, dictionary: Dictionary, node_id: int) -> None:
        self._dictionary = dictionary
        self._node_id = node_id
        self.numbers: dict[int, int] = {}
        self._saved: dict[int, int] = {}
        self._domains: dict[int, bytes] = {}
        self._saved_domains: dict[int, bytes] = {}
        self.guards: dict[int, Callable[[int], None]] = {}
        self.followers: dict[int, Callable[[int], None]] = {}
        self.restore(ALL)

    def of_axis(self, axis: int) -> AxisObjects:
        """What the drive of axis 1 to 3 works with."""
        if axis == 1:
            return AxisObjects(self.numbers, self.guards, self.followers)
        return AxisObjects(_Shifted(self.numbers, axis), _Shifted(self.guards, axis), _Shifted(self.followers, axis))

    def add(self, entry: Entry) -> None:
        """The drive has one object more, with its default as power-on value."""
        entries, indices = self._dictionary.entries, self._dictionary.indices
        self._dictionary = Dictionary({**entries, entry.key: entry}, indices | {entry.key >> 8})
        self.numbers[entry.key] = entry.default

    def restore(self, indices: range) -> None:
        """Power-on values for all objects in `indices`. Neither guards nor followers are called."""
        for key, entry in self._dictionary.entries.items():
            if entry.code and key >> 8 in indices:
                default = entry.default + (self._node_id if entry.relative else 0)
                self.numbers[key] = self._saved.get(key, default)
            elif entry.writable and key >> 8 in indices:
                self._domains[key] = self._saved_domains.get(key, entry.text)

    def save(self) -> None:
        """Keep the drive's parameters as power-on values.

        Process data are none, communication is the master's, and what can only be written is an order.
        """
        for key, entry in self._dictionary.entries.items():
            parameter = key >> 8 not in COMMUNICATION and first_axis_index(key >> 8) not in PROCESS_DATA
            if entry.code and entry.readable and entry.writable and parameter:
                self._saved[key] = self.numbers[key]
        self._saved_domains = dict(self._domains)

    def declare(self, entry: Entry) -> None:
        """Have this object, at its power-on value; an entry of the same key goes."""
        entries = {**self._dictionary.entries, entry.key: entry}
        self._dictionary = Dictionary(entries, self._dictionary.indices | {entry.key >> 8})
        if entry.code:
            self.numbers[entry.key] = entry.default + (self._node_id if entry.relative else 0)

    def lack(self, index: int) -> None:
        """Have no object at this index."""
        entries = {key: entry for key, entry in self._dictionary.entries.items() if key >> 8 != index}
        self._dictionary = Dictionary(entries, self._dictionary.indices - {index})

    def guard(self, key: int, guard: Callable[[int], None]) -> None:
        """Ask `guard`, too, before a value is stored; it is asked first."""
        before = self.guards.get(key)

        def both(value: int) -> None:
            guard(value)
            if before is not None:
                before(value)

        self.guards[key] = both

    def entry(self, key: int) -> Entry:
        """Raises:
        AccessRefused: there is no such object, or no such sub-index.
        """
        entry = self._dictionary.entries.get(key)
        if entry is None:
            raise AccessRefused(Abort.NO_SUB_INDEX if key >> 8 in self._dictionary.indices else Abort.NO_OBJECT)
        return entry

    def readable(self, key: int) -> Entry:
        """The entry, if it may be read.

        Raises:
            AccessRefused: it does not exist or is write-only.
        """
        entry = self.entry(key)
        if not entry.readable:
            raise AccessRefused(Abort.WRITE_ONLY)
        return entry

    def writable(self, key: int) -> Entry:
        """The entry, if it may be written.

        Raises:
            AccessRefused: it does not exist or is read-only.
        """
        entry = self.entry(key)
        if not entry.writable:
            raise AccessRefused(Abort.READ_ONLY)
        return entry

    def read(self, key: int) -> bytes:
        """The value as it goes over the bus, little-endian.

        Raises:
            AccessRefused: it does not exist or is write-only.
        """
        entry = self.readable(key)
        if entry.code:
            return entry.layout.pack(self.numbers[key])
        return self._domains.get(key, entry.text)

    def write(self, key: int, data: bytes) -> None:
        """Store a value as it came over the bus.

        Raises:
            AccessRefused: no such object, read-only, wrong length, out of range, or refused by its owner.
        """
        entry = self.writable(key)
        self.check_size(entry, len(data))
        if entry.code:
            self.put(key, entry.layout.unpack(data)[0])
        else:
            self._domains[key] = data

    def check_size(self, entry: Entry, size: int) -> None:
        """Raises:
        AccessRefused: a value of `size` bytes is not as long as the object, or longer than a domain can be.
        """
        if size > entry.longest:
            raise AccessRefused(Abort.TOO_LONG)
        if entry.code and size < entry.longest:
            raise AccessRefused(Abort.TOO_SHORT)

    def put(self, key: int, value: int) -> None:
        """Store a number in a writable object.

        Raises:
            AccessRefused: out of range, or refused by its owner.
        """
        entry = self._dictionary.entries[key]
        if value > entry.high:
            raise AccessRefused(Abort.TOO_HIGH)
        if value < entry.low:
            raise AccessRefused(Abort.TOO_LOW)
        guard = self.guards.get(key)
        if guard is not None:
            guard(value)
        self.numbers[key] = value
        follower = self.followers.get(key)
        if follower is not None:
            follower(value)


def save_on_command(objects: Objects) -> None:
    """A write of the signature to 1010h:01 makes the present parameters the power-on values."""

    def save(_signature: int) -> None:
        objects.numbers[_SAVE_ALL] = _SAVES_ON_COMMAND
        objects.save()

    objects.guards[_SAVE_ALL] = _only_the_signature
    objects.followers[_SAVE_ALL] = save


def _only_the_signature(value: int) -> None:
    if value != int.from_bytes(SAVE, "little"):
        raise AccessRefused(Abort.CANNOT_STORE)
