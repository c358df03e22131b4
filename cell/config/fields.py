"""Values that several files share: names, endpoints, file names, poses."""

import re
from ipaddress import IPv6Address
from typing import Annotated

import numpy as np
from pydantic import AfterValidator, BaseModel, Field

from cell.config.settings import PoseSettings
from cell.config.units import STRICT, Angle, Length
from cell.geometry import from_xyz_abc

Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,31}$", description="a name that can be part of a key")]
FileName = Annotated[str, Field(min_length=1, description="a file, relative to this one")]

_ZEROS = re.compile(r"(0+|0[xX]0+)(\.(0+|0[xX]0+)){0,3}")
_ENDPOINT = re.compile(r"tcp/(?P<host>\[[0-9a-fA-F:.%]+\]|[^\s/:\[\]]+):(?P<port>[0-9]{1,5})")


def is_everywhere(host: str) -> bool:
    """Whether to listen there is to listen on every address of a computer: 0.0.0.0 and [::], however they are written.

    Nobody is reached there from another computer.
    """
    if host == "*":
        return True
    try:
        if ":" in host:
            address = IPv6Address(host.strip("[]"))
            return (address.ipv4_mapped or address).is_unspecified
        # As inet_aton(3) reads it: up to four numbers, decimal, octal or hexadecimal, all of them zero.
        return _ZEROS.fullmatch(host) is not None
    except ValueError:
        return False


def _endpoint(value: str) -> str:
    match = _ENDPOINT.fullmatch(value)
    if match is None or not 1 <= int(match["port"]) <= 65535:
        raise ValueError("tcp/HOST:PORT with a port of 1 to 65535")
    if is_everywhere(match["host"]):
        raise ValueError(f"an address under which the others reach it; it listens on all of its own with -l {value}")
    return value


Endpoint = Annotated[
    str, AfterValidator(_endpoint), Field(description="tcp/HOST:PORT", json_schema_extra={"pattern": "^tcp/.+:[0-9]+$"})
]


def host_and_port(endpoint: str) -> tuple[str, int]:
    """Host and port of a valid endpoint; `localhost` and its address are the same host."""
    match = _ENDPOINT.fullmatch(endpoint)
    if match is None:
        raise ValueError(f"found {endpoint!r}, allowed tcp/HOST:PORT")
    host = match["host"].lower()
    return "127.0.0.1" if host in ("localhost", "[::1]") else host, int(match["port"])


Point = tuple[Length, Length, Length]


class Pose(BaseModel):
    """A pose: position X, Y, Z and angles A, B, C with R = Rz(C) Ry(B) Rx(A), all about the fixed axes."""

    model_config = STRICT
    X: Length = Field(description="position along X, in units.length")
    Y: Length = Field(description="position along Y, in units.length")
    Z: Length = Field(description="position along Z, in units.length")
    A: Angle = Field(description="angle about X, in units.angle")
    B: Angle = Field(description="angle about Y, in units.angle")
    C: Angle = Field(description="angle about Z, in units.angle")

    def settings(self) -> PoseSettings:
        """The same pose as position [m] and quaternion."""
        return PoseSettings.of(from_xyz_abc(np.array([self.X, self.Y, self.Z, self.A, self.B, self.C])))
