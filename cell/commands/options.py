"""Arguments and options that several commands share, so that they mean the same everywhere."""

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from cell.net.options import ZenohOptions

CELL_FILE = "cell.yaml"

CellFileArgument = Annotated[Path, typer.Argument(metavar="FILE", help="The cell file.", show_default=False)]
"""For commands that start something or look at a file: the file is their subject."""

CellFileOption = Annotated[
    Path,
    typer.Option(
        "-f",
        "--file",
        metavar="FILE",
        envvar="ZENCELL_FILE",
        help="The cell file of the running cell.",
    ),
]
"""For operators' commands: the same file every time, so it may come from the environment or the working folder."""

RobotArgument = Annotated[str, typer.Argument(metavar="ROBOT", help="Name of the robot in the cell file.")]


class Control(Enum):
    """How far a page may steer."""

    OPERATE = "operate"
    CONFIGURE = "configure"


ControlOption = Annotated[
    Control | None,
    typer.Option(
        "--control",
        help="Print an address of the page for operating, or one for configuring too. Without it the page can only be "
        "watched.",
        show_default=False,
    ),
]
PortOption = Annotated[
    int, typer.Option("--port", min=0, max=65535, metavar="PORT", help="Of the page; 0: any that is free.")
]
PORT = 8080

StateDirOption = Annotated[
    Path | None,
    typer.Option(
        "--state-dir",
        metavar="FOLDER",
        help="Where the process keeps what must outlive it. [default: .zencell/<cell>/ beside the cell file]",
        show_default=False,
    ),
]

JsonOption = Annotated[bool, typer.Option("--json", help="For programs: one JSON object per line, in SI units.")]
"""Of whatever lists something (`cell.commands.client.json_lines`)."""

LogJsonOption = Annotated[
    bool, typer.Option("--log-json", help="Log one JSON object per line, for programs that collect logs.")
]
"""Of whatever runs until it is stopped (`cell.commands.processes.log_file`)."""

ParentPipeOption = Annotated[int | None, typer.Option("--parent-pipe", hidden=True)]

ModeOption = Annotated[
    str | None,
    typer.Option("-m", "--mode", metavar="MODE", help="Zenoh session mode: peer or client.", show_default=False),
]
ConnectOption = Annotated[
    list[str] | None,
    typer.Option(
        "-e",
        "--connect",
        metavar="ENDPOINT",
        help="Zenoh endpoint to connect to instead of the cell file's; may be repeated.",
        show_default=False,
    ),
]
ListenOption = Annotated[
    list[str] | None,
    typer.Option(
        "-l",
        "--listen",
        metavar="ENDPOINT",
        help="Zenoh endpoint to listen on instead of the cell file's; may be repeated.",
        show_default=False,
    ),
]
ConfigOption = Annotated[
    Path | None, typer.Option("-c", "--config", metavar="FILE", help="Zenoh configuration file.", show_default=False)
]
CfgOption = Annotated[
    list[str] | None,
    typer.Option("--cfg", metavar="KEY:VALUE", help="Change one value of the Zenoh configuration.", show_default=False),
]


def zenoh_options(
    mode: str | None, connect: list[str] | None, listen: list[str] | None, config: Path | None, cfg: list[str] | None
) -> "ZenohOptions":
    """The five Zenoh options of a command line as one value."""
    from cell.net.options import ZenohOptions

    return ZenohOptions(
        mode=mode, connect=tuple(connect or ()), listen=tuple(listen or ()), config=config, settings=tuple(cfg or ())
    )
