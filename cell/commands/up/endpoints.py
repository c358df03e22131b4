"""Whether the endpoints of a cell are free on this host, before anything is started on them.

`cell up` would otherwise be a client of the foreign cell that answers there, until its own manager fails.
"""

import re
import socket

from cell.commands.errors import CommandError
from cell.config.settings import CellSettings
from cell.net.endpoint import who_answers
from cell.net.options import ZenohOptions

CONNECT_S = 1.0
_TCP = re.compile(r"tcp/(?P<host>.+):(?P<port>\d+)")


def refuse_taken(settings: CellSettings) -> None:
    """Raise `CommandError` for the first endpoint at which somebody answers already, with who that is."""
    for endpoint in (settings.manager_endpoint, *(gateway.endpoint for gateway in settings.gateways.values())):
        if _answers(endpoint):
            raise CommandError(
                f"{endpoint} is in use; {who_answers(endpoint, ZenohOptions())}",
                f"stop it, or write another endpoint into {settings.file}",
            )


def _answers(endpoint: str) -> bool:
    address = _TCP.fullmatch(endpoint)
    if address is None:
        return False
    try:
        with socket.create_connection((address["host"].strip("[]"), int(address["port"])), CONNECT_S):
            return True
    except OSError:
        return False
