"""The command `cell`: its subcommands, one file each."""

import typer

from cell.commands import (
    check,
    drives,
    estop,
    jog,
    manager,
    model,
    plot,
    reset,
    robot,
    schema,
    set_up,
    status,
    up,
    zone,
)
from cell.commands.errors import run_app

FILE = "cell_configs/two_arms/cell.yaml"
MODEL = "cell_configs/models/six_axis.yaml"
HELP = {"help_option_names": ["-h", "--help"]}

app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings=HELP,
    help="A cell of robots: start it, watch it, give it orders. Orders find the cell by -f FILE or ZENCELL_FILE.",
    epilog=f"Example: cell up {FILE} --until-done",
)
zones = typer.Typer(
    no_args_is_help=True,
    context_settings=HELP,
    help="An operator's word about an exclusive zone.",
    epilog=f"Example: cell zone clear handover -f {FILE}",
)

app.command("check", epilog=f"Example: cell check {FILE}")(check.check)
app.command("model", epilog=f"Example: cell model {MODEL}")(model.model)
app.command("schema", epilog="Example: cell schema cell > cell.schema.json")(schema.schema)
app.command(
    "plot",
    epilog="Example: cell plot cell_configs/two_arms/programs/left.prog --model cell_configs/models/six_axis.yaml",
)(plot.plot)
app.command("up", epilog=f"Example: cell up {FILE} --until-done")(up.up)
app.command("status", epilog=f"Example: cell status -f {FILE}")(status.status)
app.command("drives", epilog=f"Example: cell drives -f {FILE}")(drives.drives)
app.command("manager", epilog=f"Example: cell manager {FILE}")(manager.manager)
app.command("enable", epilog=f"Example: cell enable left -f {FILE}")(robot.enable)
app.command("run", epilog=f"Example: cell run left right -f {FILE}")(robot.run)
app.command("halt", epilog=f"Example: cell halt left -f {FILE}")(robot.halt)
app.command("continue", epilog=f"Example: cell continue left -f {FILE}")(robot.continue_)
app.command("step", epilog=f"Example: cell step left -f {FILE}")(robot.step)
app.command("override", epilog=f"Example: cell override left 30 -f {FILE}")(robot.override)
app.command("manual", epilog=f"Example: cell manual left on -f {FILE}")(robot.manual)
app.command("jog", epilog=f"Example: cell jog left Z + --speed 20 --step 50 -f {FILE}")(jog.jog)
app.command("disable", epilog=f"Example: cell disable left -f {FILE}")(robot.disable)
app.command("home", epilog=f"Example: cell home left -f {FILE}")(set_up.home)
app.command("move", epilog=f"Example: cell move left J1=5 J2=-3 --by -f {FILE}")(set_up.move)
app.command("accept", epilog=f"Example: cell accept left J2 -f {FILE}")(set_up.accept)
app.command("estop", epilog=f'Example: cell estop --reason "door open" -f {FILE}')(estop.estop)
app.command("reset", epilog=f"Example: cell reset left -f {FILE}")(reset.reset)
zones.command("clear", epilog=f"Example: cell zone clear handover -f {FILE}")(zone.clear)
zones.command("adopt", epilog=f"Example: cell zone adopt handover left -f {FILE}")(zone.adopt)
app.add_typer(zones, name="zone")


def main() -> None:
    """Run the words of the command line."""
    run_app(lambda: app(prog_name="cell"), "cell")
