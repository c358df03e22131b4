"""How a drives file names an object of a drive: index and sub-index in hex."""

from typing import Annotated

from pydantic import Field

ObjectAddress = Annotated[str, Field(pattern=r"^[0-9A-Fa-f]{4}:[0-9A-Fa-f]{2}$", description="an object: 6041:00")]


def address_of(text: str) -> tuple[int, int]:
    """Index and sub-index of an address."""
    index, _, sub = text.partition(":")
    return int(index, 16), int(sub, 16)
