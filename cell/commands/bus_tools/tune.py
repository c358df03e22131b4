"""`drive-gateway tune`: what the servo loop of a simulated axis does, measured on its model."""

from cmath import phase
from math import degrees, isinf, log10
from pathlib import Path

import typer
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from cell.commands.client.cell_view import names
from cell.commands.errors import CommandError, not_installed
from cell.commands.pages.text_chart import chart
from drive_gateway.config import GatewaySettings
from drive_gateway.sim.axis.axis_data import AxisData
from drive_gateway.sim.axis.response import (
    Margins,
    Point,
    Step,
    frequencies,
    frequency_response,
    margins,
    step_response,
)
from drive_gateway.sim.config.simulation import Simulation

LOWEST_HZ, HIGHEST_HZ, POINTS = 5.0, 2000.0, 40
STEP_S = 0.1
ENOUGH = 2.0
"""A gain margin below this leaves too little for what changes with load and pose."""


def show_tuning(gateway: GatewaySettings, simulation: Simulation, axis: str, output: Path | None = None) -> None:
    """Measure and print the loop of one axis, named as `J1` or, where several robots share the bus, as `left.J1`.

    With `output` the curves also go to that HTML page.

    Raises:
        CommandError: no such axis, or the simulation says nothing of its motor and load.
    """
    name, data = _axis(gateway, simulation, axis)
    points = frequency_response(data, frequencies(LOWEST_HZ, HIGHEST_HZ, POINTS))
    step, found = step_response(data, STEP_S), margins(points)
    console = Console()
    summary = _summary(data, step, found)
    console.print(_table(name, summary))
    for line in _plots(points, step):
        typer.echo(line)
    console.print(_numbers(points))
    if output is not None:
        try:
            from cell.commands.bus_tools.tune_page import tune_page
            from cell.commands.pages.page import write_page
        except ImportError as error:
            raise not_installed("the page of drive-gateway tune", "view", error) from error
        lines = [f"{what}: {value}" for what, value in summary.items()]
        write_page(output, tune_page(name, lines, points, step, found))
        typer.echo(f"the curves are in {output}")
    if found.gain < ENOUGH:
        typer.echo(
            f"The gain margin is below {ENOUGH:g}: lower axes ... servo.speed_hz of {name} in the simulation file."
        )


def _axis(gateway: GatewaySettings, simulation: Simulation, axis: str) -> tuple[str, AxisData]:
    axes = [(robot, drive.name) for robot, drives in gateway.robots.items() for drive in drives.axes]
    wanted = [place for place in axes if axis in (place[1], ".".join(place))]
    if len(wanted) != 1:
        known = names([".".join(place) for place in axes])
        reason = "several axes are called" if wanted else "no axis"
        raise CommandError(f"{reason} {axis!r} on {gateway.name}; its axes are: {known}")
    name = ".".join(wanted[0])
    data = simulation.axes.get(wanted[0])
    if data is None:
        raise CommandError(
            f"nothing says which motor and load {name} has on {gateway.name}",
            "add them below `axes` in the simulation file beside its drives file (docs/simulated_drives.md)",
        )
    return name, data


def _table(name: str, summary: dict[str, str]) -> Table:
    table = Table(title=f"speed loop of {name}", title_justify="left", box=SIMPLE, show_header=False)
    for what, value in summary.items():
        table.add_row(what, value)
    return table


def _summary(data: AxisData, step: Step, found: Margins) -> dict[str, str]:
    gains = data.gains
    ratio = (data.inertia - data.motor.inertia_kg_m2) / data.motor.inertia_kg_m2
    return {
        "motor": f"{data.motor.name}, gear {data.gear:g}",
        "inertia at the motor": f"{1e4 * data.inertia:.3g} kg cm2, load to motor {ratio:.2f} : 1",
        "gains": f"position {gains.position:g} 1/s, speed {gains.speed:.3g} A s/rad, reset {data.servo.reset_s:g} s",
        "gain margin": f"{_db(found.gain)} at {_hz(found.gain_hz)} (open loop, phase -180 deg)",
        "phase margin": f"{found.phase_deg:.1f} deg at {_hz(found.crossover_hz)} (open loop, gain 1)",
        "step": f"rises in {1e3 * step.rise_s:.1f} ms, overshoots by {100 * step.overshoot:.0f} %, "
        f"within 5 % after {1e3 * step.settled_s:.0f} ms",
    }


def _plots(points: list[Point], step: Step) -> list[str]:
    """Step, then gain and phase over frequency."""
    gains = [("o", [_decibel(abs(point.open)) for point in points]), ("c", [_decibel(abs(p.closed)) for p in points])]
    left, right = f"{LOWEST_HZ:g} Hz", f"{HIGHEST_HZ:g} Hz"
    return [
        *chart("step of the speed, part of its height", [("*", step.speed)], "0 ms", f"{1e3 * STEP_S:g} ms", "1"),
        "",
        *chart("gain, o: open loop, c: closed loop", gains, left, right, "dB"),
        "",
    ]


def _numbers(points: list[Point]) -> Table:
    table = Table(box=SIMPLE)
    for heading in ("Hz", "open dB", "open deg", "closed dB", "closed deg"):
        table.add_column(heading, justify="right")
    for point in points[::2]:
        table.add_row(f"{point.hz:.1f}", *_polar(point.open), *_polar(point.closed))
    return table


def _polar(gain: complex) -> tuple[str, str]:
    return f"{_decibel(abs(gain)):.1f}", f"{degrees(phase(gain)):.0f}"


def _decibel(gain: float) -> float:
    return 20.0 * log10(gain)


def _db(gain: float) -> str:
    return "unlimited" if isinf(gain) else f"{gain:.2f} ({_decibel(gain):.1f} dB)"


def _hz(hz: float) -> str:
    return "no frequency measured" if isinf(hz) else f"{hz:.0f} Hz"
