"""The command `cell`: its subcommands, and the module in which each of them is."""

from importlib.metadata import version
from typing import Annotated

import typer

from cell.commands.errors import run_app
from cell.commands.subcommands import HELP, Subcommand, subcommands
from cell.view.gate import Level

WATCH, CONFIGURE = Level.WATCH, Level.CONFIGURE
FILE = "cell_configs/two_arms/cell.yaml"
BELT = "cell_configs/belt/cell.yaml"
MODEL = "cell_configs/models/six_axis.yaml"
PROGRAM = "cell_configs/two_arms/programs/left.prog"
CAM_FILE = "cell_configs/engraving/programs/plate.nc"

COMMANDS = {
    "examples": Subcommand(".files.examples", "examples", "cell examples", WATCH),
    "check": Subcommand(".files.check", "check", f"cell check {FILE}", WATCH),
    "model": Subcommand(".files.model", "model", f"cell model {MODEL}", WATCH),
    "schema": Subcommand(".files.schema", "schema", "cell schema cell > cell.schema.json", WATCH),
    "format": Subcommand(".files.format", "format_", f"cell format {PROGRAM}", WATCH),
    "import": Subcommand(".files.import_cam", "import_", f"cell import {CAM_FILE}", WATCH),
    "plot": Subcommand(".files.plot", "plot", f"cell plot {PROGRAM} --model {MODEL}", WATCH),
    "up": Subcommand(".up.up", "up", f"cell up {FILE} --until-done"),
    "status": Subcommand(".operator.status", "status", f"cell status -f {FILE}", WATCH),
    "view": Subcommand(".operator.view", "view", f"cell view --control operate -f {FILE}", WATCH),
    "monitor": Subcommand(".operator.monitor", "monitor", f"cell monitor -f {FILE}", WATCH),
    "why": Subcommand(".operator.why", "why", f"cell why left -f {FILE}", WATCH),
    "events": Subcommand(".operator.events", "events", f"cell events --since 10m --severity alarm -f {FILE}", WATCH),
    "record": Subcommand(".operator.record", "record", f"cell record stop.mcap -f {FILE}", WATCH),
    "replay": Subcommand(".files.replay", "replay", "cell replay stop.mcap --from -10 --speed 0.5", WATCH),
    "report": Subcommand(".files.report", "report", "cell report stop.mcap -o stop.html", WATCH),
    "drives": Subcommand(".operator.drives", "drives", f"cell drives -f {FILE}", WATCH),
    "manager": Subcommand(".processes.manager", "manager", f"cell manager {FILE}"),
    "enable": Subcommand(".operator.robot_orders", "enable", f"cell enable left -f {FILE}"),
    "run": Subcommand(".operator.robot_orders", "run", f"cell run left right -f {FILE}"),
    "load": Subcommand(".operator.robot_orders", "load", f"cell load left programs/left.prog -f {FILE}"),
    "halt": Subcommand(".operator.robot_orders", "halt", f"cell halt left -f {FILE}", WATCH),
    "stop": Subcommand(".operator.robot_orders", "stop", f"cell stop left -f {FILE}"),
    "continue": Subcommand(".operator.robot_orders", "continue_", f"cell continue left -f {FILE}"),
    "return": Subcommand(".operator.robot_orders", "return_", f"cell return left -f {FILE}"),
    "step": Subcommand(".operator.robot_orders", "step", f"cell step left -f {FILE}"),
    "override": Subcommand(".operator.robot_orders", "override", f"cell override left 30 -f {FILE}"),
    "set": Subcommand(".operator.robot_orders", "set_", f"cell set left joint_speed 50 -f {FILE}", CONFIGURE),
    "tool": Subcommand(".operator.robot_orders", "tool", f"cell tool left none -f {FILE}"),
    "part": Subcommand(".operator.robot_orders", "part", f"cell part left none -f {FILE}"),
    "flag": Subcommand(".operator.robot_orders", "flag", f"cell flag left 7 -f {FILE}"),
    "input": Subcommand(".operator.robot_orders", "input_", f"cell input left part_present on -f {FILE}", CONFIGURE),
    "manual": Subcommand(".operator.robot_orders", "manual", f"cell manual left on -f {FILE}"),
    "jog": Subcommand(".operator.jog", "jog", f"cell jog left Z + --speed 20 --step 50 -f {FILE}"),
    "teach": Subcommand(".operator.point", "teach", f"cell teach left pick -f {FILE}", CONFIGURE),
    "points": Subcommand(".operator.point", "points", f"cell points left -f {FILE}", WATCH),
    "go": Subcommand(".operator.point", "go", f"cell go left pick -f {FILE}"),
    "disable": Subcommand(".operator.robot_orders", "disable", f"cell disable left -f {FILE}"),
    "home": Subcommand(".operator.set_up", "home", f"cell home left -f {FILE}"),
    "move": Subcommand(".operator.set_up", "move", f"cell move left J1=5 J2=-3 --by -f {FILE}"),
    "output": Subcommand(".operator.output", "output", f"cell output left gripper off -f {FILE}", CONFIGURE),
    "accept": Subcommand(".operator.set_up", "accept", f"cell accept left J2 -f {FILE}"),
    "estop": Subcommand(".operator.estop", "estop", f'cell estop --reason "door open" -f {FILE}', WATCH),
    "reset": Subcommand(".operator.reset", "reset", f"cell reset left -f {FILE}"),
    "zone show": Subcommand(".operator.zone", "show", f"cell zone show -f {FILE}", WATCH),
    "zone set": Subcommand(
        ".operator.zone", "set_", f"cell zone set handover --pose 0,0,1400,0,0,0 -f {FILE}", CONFIGURE
    ),
    "zone clear": Subcommand(".operator.zone", "clear", f"cell zone clear handover -f {FILE}"),
    "zone adopt": Subcommand(".operator.zone", "adopt", f"cell zone adopt handover left -f {FILE}"),
    "frame show": Subcommand(".operator.frame", "show", f"cell frame show -f {FILE}", WATCH),
    "frame set": Subcommand(
        ".operator.frame", "set_", f"cell frame set table --pose 900,0,700,0,0,90 -f {FILE}", CONFIGURE
    ),
    "frame teach": Subcommand(".operator.frame", "teach", f"cell frame teach table left -f {FILE}", CONFIGURE),
    "confine": Subcommand(
        ".operator.assure", "confine", f"cell confine left --box 2400,2000,2600 --pose=-1800,0,1300,0,0,0 -f {FILE}"
    ),
    "stands": Subcommand(".operator.assure", "stands", f"cell stands left -f {FILE}"),
    "setup clear": Subcommand(".operator.set_up", "clear", f"cell setup clear left -f {FILE}"),
    "simulate conveyor": Subcommand(
        ".operator.simulate", "conveyor", f"cell simulate conveyor belt --speed 50 --every 200 -f {BELT}", CONFIGURE
    ),
    "simulate sensor": Subcommand(
        ".operator.simulate", "sensor", f"cell simulate sensor picker seam Z=5 -f {BELT}", CONFIGURE
    ),
    "simulate input": Subcommand(
        ".operator.simulate", "input_", f"cell simulate input left part_present on -f {FILE}", CONFIGURE
    ),
}
"""The register of subcommands: by its words, in which module of `cell.commands` its function is, and an example.

No module says so itself, because none is imported before its command is asked for.
"""
GROUPS = {
    "zone": (
        "Exclusive zones: where they are, how one is changed, an operator's word about one.",
        f"cell zone clear handover -f {FILE}",
    ),
    "frame": ("The frames of the cell, and where they are.", f"cell frame show -f {FILE}"),
    "setup": ("An operator's word about the robot in set-up.", f"cell setup clear left -f {FILE}"),
    "simulate": (
        "Measurements and signals without a machine, for simulated cells.",
        f"cell simulate conveyor belt --speed 50 -f {BELT}",
    ),
}
"""First word of subcommands with two: what they are about, and an example."""

app = typer.Typer(
    cls=subcommands(COMMANDS),
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings=HELP,
)
for group, (about, example) in GROUPS.items():
    below = typer.Typer(
        cls=subcommands(COMMANDS, f"{group} "),
        no_args_is_help=True,
        context_settings=HELP,
        help=about,
        epilog=f"Example: {example}",
    )
    app.add_typer(below, name=group)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"zencell {version('zencell')}")
        raise typer.Exit


@app.callback(epilog=f"Example: cell up {FILE} --until-done")
def cell(
    _version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """A cell of robots: start it, watch it, give it orders. Orders find the cell by -f FILE or ZENCELL_FILE."""


def main() -> None:
    """Run the words of the command line."""
    run_app(lambda: app(prog_name="cell"), "cell")
