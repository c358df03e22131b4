"""Parameters of a drive that outlive its supply: stored on command only (1010h)."""

from drive_gateway.canopen.sdo import SAVE
from drive_gateway.sim.abort import Abort, AccessRefused
from drive_gateway.sim.dictionary import key_of
from drive_gateway.sim.objects import Objects

_SAVE_ALL = key_of(0x1010, 1)
_SAVES_ON_COMMAND = 1
"""What 1010h:01 shows: the node stores nothing by itself."""


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
