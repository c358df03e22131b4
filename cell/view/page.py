"""The page: one loop that looks at the source and draws, and what each browser has of its own."""

import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import viser

from cell.config.settings import CellSettings
from cell.geometry.arrays import Array
from cell.messages import Severity
from cell.view import panels
from cell.view.control import Control
from cell.view.controls import Controls
from cell.view.curves import Curves, Quantity
from cell.view.desk import Desk
from cell.view.diagram import Diagrams, Pair, shown
from cell.view.meshes import RobotMeshes
from cell.view.newest import Newest
from cell.view.now import NowLines
from cell.view.playback import Playback
from cell.view.rows import Axes
from cell.view.server import GatedServer, here
from cell.view.source import Player, Source
from cell.view.stage import ROBOT_COLOURS, Stage

PICTURE_S = 1.0 / 30.0
TEXT_EVERY = 6
"""Pictures between two looks at what changes seldom."""
CURVE_EVERY = 30
_LEFT, _RIGHT = 370.0, 480.0
_PAIR = " and "


class Page:
    """A page about a cell; `run` it in a thread. Without a `desk` it can only be watched."""

    def __init__(
        self,
        server: GatedServer,
        settings: CellSettings,
        source: Source,
        axes: Mapping[str, Axes],
        desk: Desk | None = None,
        player: tuple[Player, float] | None = None,
        programs: Mapping[str, tuple[str, ...]] | None = None,
        meshes: Mapping[str, RobotMeshes] | None = None,
    ) -> None:
        """`player` and its speed: where the source is a recording, which those who watch may wind.

        `programs`: by robot, the lines of its program as far as there are files here. `meshes`: likewise, how it looks;
        a robot without is drawn by its capsules.
        """
        self._server = server
        self._settings = settings
        self._source = source
        self._axes = axes
        self._desk = desk
        self._programs = programs or {}
        self._control = Control()
        self._seen = Newest()
        self._now = NowLines(settings)
        self._curves = Curves()
        self._diagrams = Diagrams(tuple(settings.robots), settings.separation)
        self._stage = Stage(server, settings, meshes)
        self._shown = _Shown(server)
        self._guests: dict[int, _Guest] = {}
        self._playback: Playback | None = None
        if player is not None:
            with self._shown.control:
                server.gui.add_markdown("**A recording.** Nothing that is chosen here reaches a robot.")
                self._playback = Playback(server.gui, *player)
        server.gui.configure_theme(dark_mode=False, show_logo=False, show_share_button=False)
        server.gui.set_panel_label(settings.name)
        server.on_client_connect(self._came)
        server.on_client_disconnect(self._went)

    async def _came(self, client: viser.ClientHandle) -> None:
        controls = None
        if self._desk is not None:
            controls = Controls(
                client, self._shown.control, here(), self._control, self._desk, self._settings, self._axes, self._seen
            )
        elif self._playback is None:
            with self._shown.control:
                client.gui.add_markdown("This page can only be watched. To operate: `cell view --control operate`.")
        self._guests[client.client_id] = _Guest(client, self._shown, self._settings, self._diagrams.pairs, controls)

    async def _went(self, client: viser.ClientHandle) -> None:
        guest = self._guests.pop(client.client_id, None)
        if guest is not None and guest.controls is not None:
            guest.controls.leave()

    def run(self, stop: threading.Event) -> None:
        """Look and draw until `stop`; with nobody there it only looks."""
        due, turn = time.monotonic(), 0
        while not stop.is_set():
            self.picture(turn)
            turn += 1
            due = max(due + PICTURE_S, time.monotonic())
            stop.wait(due - time.monotonic())

    def picture(self, turn: int) -> None:
        """Look at what is new, and draw it; the number of the picture says how much of it."""
        if self._playback is not None:
            self._playback.look()
        self._seen.look(self._source.take_new(), self._source.now())
        self._curves.look(self._seen)
        if self._guests or turn % CURVE_EVERY == 0:
            self._draw(turn)

    def _draw(self, turn: int) -> None:
        with self._server.atomic():
            self._stage.often(self._seen)
        if turn % TEXT_EVERY:
            return
        lines = self._now.of(self._seen)
        self._stage.seldom(self._seen, lines)
        self._diagrams.look(self._seen)
        self._shown.now_html.show(panels.header(self._settings, self._seen) + panels.now(lines))
        self._shown.programs_html.show(panels.programs(self._settings, self._seen, self._programs))
        self._shown.cell_html.show(panels.cell(self._seen))
        self._shown.drives_html.show(panels.drives(self._settings, self._seen, self._axes))
        self._shown.places_html.show(panels.places(self._settings, self._seen, self._axes))
        for guest in list(self._guests.values()):
            guest.show(self._seen, self._diagrams)
            if turn % CURVE_EVERY == 0:
                guest.show_curves(self._curves, self._axes)


class _Text:
    """HTML that is sent when it changes."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._handle = gui.add_html("")
        self._content = ""

    def show(self, content: str) -> None:
        if content != self._content:
            self._content = self._handle.content = content


class _Shown:
    """The panels that all browsers share."""

    def __init__(self, server: GatedServer) -> None:
        gui = server.gui
        left = gui.add_panel()
        with left.add_tab("Now", viser.Icon.ACTIVITY):
            self.now_html = _Text(gui)
        left.dock_left()
        left.set_width(_LEFT)
        tabs = gui.add_tab_group()
        self.control = tabs.add_tab("Control")
        with tabs.add_tab("Programs"):
            self.programs_html = _Text(gui)
        self.cell = tabs.add_tab("Cell")
        with self.cell:
            self.cell_html = _Text(gui)
        with tabs.add_tab("Places"):
            self.places_html = _Text(gui)
        with tabs.add_tab("Drives"):
            self.drives_html = _Text(gui)
        self.curves = tabs.add_tab("Curves")
        self.events = tabs.add_tab("Events")
        gui.main_panel.dock_right()
        gui.main_panel.set_width(_RIGHT)


@dataclass(slots=True)
class _Guest:
    """What one browser has of its own: a filter of events, a choice of curves, and perhaps control."""

    client: viser.ClientHandle
    shown: _Shown
    settings: CellSettings
    pairs: tuple[Pair, ...]
    controls: Controls | None
    _least: Any = field(init=False)
    _paused: Any = field(init=False)
    _events: _Text = field(init=False)
    _robot: Any = field(init=False)
    _quantity: Any = field(init=False)
    _plot: Any = field(init=False, default=None)
    _drawn: tuple[str, ...] = field(init=False, default=())
    _untold: _Text = field(init=False)
    _pair: Any = field(init=False, default=None)
    _diagram: _Text = field(init=False)

    def __post_init__(self) -> None:
        gui = self.client.gui
        with self.shown.events:
            self._least = gui.add_dropdown("at least", tuple(each.value for each in Severity), initial_value="info")
            self._paused = gui.add_checkbox("pause", initial_value=False)
            self._events = _Text(gui)
        with self.shown.curves:
            self._robot = gui.add_dropdown("robot", tuple(self.settings.robots))
            self._quantity = gui.add_dropdown("curves", tuple(each.value for each in Quantity))
            self._untold = _Text(gui)
        if self.pairs:
            with self.shown.cell:
                self._pair = gui.add_dropdown("who goes first", tuple(map(_PAIR.join, self.pairs)))
                self._diagram = _Text(gui)

    def show(self, seen: Newest, diagrams: Diagrams) -> None:
        """What has changed for this browser."""
        if not self._paused.value:
            self._events.show(panels.events(seen.events, Severity(self._least.value), seen.now))
        if self._pair is not None:
            one, other = self._pair.value.split(_PAIR)
            self._diagram.show(shown(diagrams, (one, other)))
        if self.controls is not None:
            self.controls.show()

    def show_curves(self, curves: Curves, axes: Mapping[str, Axes]) -> None:
        """The last minute of what this browser has chosen."""
        robot, quantity = self._robot.value, Quantity(self._quantity.value)
        times, values = curves.of(robot, quantity)
        untold = bool(len(times)) and bool(np.isnan(values).all())
        self._untold.show(panels.note(f"the drives of {robot} tell no {quantity.value}") if untold else "")
        if robot in axes and len(times) > 1 and values.shape[1] == len(axes[robot].names):
            self._draw_curves(quantity, times, values, axes[robot])

    def _draw_curves(self, quantity: Quantity, times: Array, values: Array, axes: Axes) -> None:
        if quantity is not Quantity.TORQUE:
            values = values * np.where(axes.sliding, 1000.0, np.degrees(1.0))
        data = (times, *values.T)
        names = (*axes.names, quantity.value)
        if self._plot is not None and names == self._drawn:
            self._plot.data = tuple(np.asarray(each, float) for each in data)
            return
        if self._plot is not None:
            self._plot.remove()
        unit = "Nm or N" if quantity is Quantity.TORQUE else "mm or deg"
        series: tuple[Any, ...] = tuple(
            {"label": name, "stroke": "#{:02x}{:02x}{:02x}".format(*ROBOT_COLOURS[i % len(ROBOT_COLOURS)]), "width": 2}
            for i, name in enumerate(axes.names)
        )
        with self.shown.curves:
            self._plot = self.client.gui.add_uplot(
                data=data,
                series=({"label": "s"}, *series),
                title=f"{quantity.value} [{unit}{'/s' if quantity is Quantity.SPEED else ''}]",
                scales={"x": {"time": False, "auto": True}, "y": {"auto": True}},
                legend={"show": True},
                height=320,
            )
        self._drawn = names
