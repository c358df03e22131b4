"""The one form in which commands that list something tell it to programs: an object per line."""

import json

import pydantic_core

from cell.commands.client.cell_view import Snapshot
from cell.config.settings import CellSettings


def json_line(kind: str, name: str, what: object = None, **more: object) -> str:
    """`{"kind": ..., "name": ...}`, then `more`, then the fields of the message or the part of one that is told."""
    told = {} if what is None else pydantic_core.to_jsonable_python(what)
    return json.dumps({"kind": kind, "name": name, **more, **told})


def status_lines(settings: CellSettings, seen: Snapshot) -> list[str]:
    """Manager, robots, gateways, zones and meetings; who does not answer has `"silent": true` and nothing else."""
    manager = seen.manager
    told: list[tuple[str, str, object]] = [("manager", settings.name, manager)]
    told += [("robot", name, seen.robots.get(name)) for name in settings.robots]
    told += [("gateway", name, seen.gateways.get(name)) for name in settings.gateways]
    lines = [json_line(kind, name, state, silent=state is None) for kind, name, state in told]
    if manager is not None:
        lines += [json_line("zone", name, zone) for name, zone in manager.zones.items()]
        lines += [json_line("meeting", name, meeting) for name, meeting in manager.meetings.items()]
    return lines
