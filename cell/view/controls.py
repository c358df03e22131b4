"""What an operator can do on the page: there for the one browser that has control, and for no other."""

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import viser

from cell.config.settings import CellSettings
from cell.messages import (
    AdoptZone,
    AnswerFlag,
    ClearZone,
    Command,
    Continue,
    Disable,
    Enable,
    ForceInput,
    ForceOutput,
    GatewayState,
    Go,
    Halt,
    Heard,
    Jog,
    JogFrame,
    ManagerState,
    PointKind,
    ResetEstop,
    ResetRobot,
    Return,
    RobotState,
    Run,
    SetManual,
    SetOverride,
    Step,
    SwitchOutput,
    Teach,
)
from cell.messages.common import Name, Text
from cell.view.control import Control
from cell.view.desk import Desk, NoAnswer
from cell.view.gate import Level
from cell.view.jog_button import JogButton
from cell.view.newest import Newest
from cell.view.panels import note
from cell.view.rows import Axes
from cell.view.server import Here

JOINTS = "joints"
MOST_SAID = 4
"""Answers that are shown."""
TOOL_AXES = ("X", "Y", "Z", "A", "B", "C")
FASTEST_M_S, FASTEST_RAD_S = 0.25, math.radians(30.0)
"""Of a jog at 100 %; the robot keeps to 250 mm/s whatever is asked for."""
PERCENTS = ("10", "25", "50", "75", "100")
ESTOP_STYLE = (
    "<style>div:has(>.zencell-estop)+div button{height:4.2em!important;font-size:17px;font-weight:700;"
    "background:#dc2626!important;color:#fff!important}"
    "div:has(>.zencell-estop)+div{position:sticky;top:0;z-index:9}</style><div class='zencell-estop'></div>"
)
JOG_STYLE = (
    "<style>div:has(>div>.zencell-jog){display:grid;grid-template-columns:1fr 1fr}"
    "div:has(>.zencell-jog){grid-column:1/-1}</style><div class='zencell-jog'></div>"
)
"""The two directions of an axis beside each other."""
ORDERS: Mapping[str, Mapping[str, type[Command]]] = {
    "drives": {"Enable": Enable, "Disable": Disable, "Reset": ResetRobot},
    "program": {"Run": Run, "Continue": Continue, "Step": Step},
}
"""To one robot, by the words of their buttons; those that are pressed most have buttons of their own."""
_FORCES: Mapping[str, bool | None] = {"force on": True, "force off": False, "follow": None}
"""Of an output, by the words of their buttons."""


_ORDER = {words: command for orders in ORDERS.values() for words, command in orders.items()}


class Controls:
    """The part of the page that gives orders, of one browser, in a tab that all browsers have."""

    def __init__(
        self,
        client: viser.ClientHandle,
        tab: viser.GuiTabHandle,
        here: Here,
        control: Control,
        desk: Desk,
        settings: CellSettings,
        axes: Mapping[str, Axes],
        seen: Newest,
    ) -> None:
        self._gui = client.gui
        self._tab = tab
        self._here = here
        self._visitor = here.visitor
        self._control = control
        self._desk = desk
        self._settings = settings
        self._axes = axes
        self._seen = seen
        self._said: list[Text] = []
        self._place: Any = None
        """What only the holder has."""
        self._take: Any = None
        if self._visitor.level >= Level.OPERATE:
            # Above the tabs: it is there whichever of them is open.
            self._gui.add_html(ESTOP_STYLE, order=-2.0)
            stop = self._gui.add_button("EMERGENCY STOP", color="red", icon=viser.Icon.HAND_STOP, order=-1.0)
            stop.on_click(self._stop_all)
        with tab:
            self._who = self._gui.add_html("")
            if self._visitor.level >= Level.OPERATE:
                self._take = self._gui.add_button("Take control")
                self._take.on_click(self._take_or_leave)
            self._answer = self._gui.add_html("")

    # Control

    def leave(self) -> None:
        """The browser has gone."""
        self._control.leave(self._visitor)

    def show(self) -> None:
        """Who has control now; the widgets come and go with it."""
        holder = self._control.holder
        mine = holder == self._visitor
        who = "nobody has control" if holder is None else "you have control" if mine else f"{holder} has control"
        if self._visitor.level < Level.OPERATE:
            who += "; this address may only watch"
        self._set(self._who, note(who))
        self._set(self._answer, note(*self._said, room=MOST_SAID))
        if self._take is not None:
            label = "Give control back" if mine else "Take control" if holder is None else f"Take control from {holder}"
            if self._take.label != label:
                self._take.label = label
        if mine and self._place is None:
            with self._tab:
                self._build()
        elif not mine and self._place is not None:
            self._place.remove()
            self._place = None

    async def _take_or_leave(self, _event: object) -> None:
        if self._control.holder == self._visitor:
            self._control.leave(self._visitor)
            self._say("control was given back")
        else:
            before = self._control.take(self._visitor)
            self._say(f"control was taken from {before}" if before is not None else "control was taken")

    def _say(self, text: Text) -> None:
        self._said = [*self._said, text][-MOST_SAID:]

    @staticmethod
    def _set(handle: Any, content: str) -> None:
        if handle.content != content:
            handle.content = content

    # Orders

    def _stop_all(self, _event: object) -> None:
        self._say("sending an emergency stop; who has confirmed it stands on the left")
        self._desk.stop_all(self._say)

    def _gives(self, order: Callable[[Any], Command], level: Level = Level.OPERATE) -> Callable[[Any], None]:
        """What gives the chosen robot an order, made from the event of a widget; it runs in a thread of `viser`'s."""

        def give(event: Any) -> None:
            robot = self._robot.value
            state = self._seen.last(RobotState, robot)
            if state is None:
                self._say(f"robot {robot} does not answer")
            else:
                self._ask(f"robot/{robot}", order(event), Heard(state[0].boot, state[0].sequence), level)

        return give

    def _ask(self, to: Text, command: Command, heard: Heard, level: Level = Level.OPERATE) -> bool:
        if not self._control.may(self._visitor, level):
            self._say(f"refused: {command.verb} is for level {level.name.lower()}, and for who has control")
            return False
        try:
            reply = self._desk.ask(to, command, heard)
        except NoAnswer as error:
            self._say(str(error))
            return False
        self._say(f"{to}: {reply.text}")
        return reply.ok

    def _ask_manager(self, command: Command, level: Level = Level.OPERATE) -> bool:
        state = self._seen.last(ManagerState, self._settings.name)
        if state is None:
            self._say("the manager does not answer")
            return False
        return self._ask("manager", command, Heard(state[0].boot, state[0].sequence), level)

    def _reset_all(self, _event: object) -> None:
        """Clear the stops that are shown now, then acknowledge what is left; nothing moves by it."""
        state = self._seen.last(ManagerState, self._settings.name)
        stops = tuple(estop.id for estop in state[0].estops) if state is not None else ()
        if stops and not self._ask_manager(ResetEstop(self._desk.operator, stops)):
            return
        for robot in self._settings.robots:
            heard = self._seen.last(RobotState, robot)
            if heard is not None:
                self._ask(f"robot/{robot}", ResetRobot(), Heard(heard[0].boot, heard[0].sequence))

    # Widgets

    def _build(self) -> None:
        gui = self._gui
        self._place = gui.add_folder("Orders")
        with self._place:
            self._robot = gui.add_dropdown("robot", tuple(self._settings.robots))
            self._robot.on_update(lambda _: self._show_axes())
            gui.add_button("Halt", color="orange").on_click(self._gives(lambda _: Halt()))
            for about, orders in ORDERS.items():
                group = gui.add_button_group(about, tuple(orders))
                group.on_click(self._gives(lambda event: _ORDER[event.target.value]()))
            gui.add_button("Return to the path: look at the way first").on_click(self._gives(lambda _: Return()))
            override = gui.add_button_group("override %", PERCENTS)
            override.on_click(self._gives(lambda event: SetOverride(float(event.target.value))))
            manual = gui.add_button_group("250 mm/s", ("on", "off"))
            manual.on_click(self._gives(lambda event: SetManual(event.target.value == "on")))
            self._build_jog()
            self._build_cell()
            if self._visitor.level >= Level.CONFIGURE:
                self._build_configure()

    def _build_jog(self) -> None:
        gui = self._gui
        with gui.add_folder("Jog"):
            frames = (JOINTS, *(frame.value for frame in JogFrame), *self._settings.frames)
            self._frame = gui.add_dropdown("along", frames)
            self._frame.on_update(lambda _: self._show_axes())
            self._speed = gui.add_slider("speed %", min=1, max=100, step=1, initial_value=20)
            with gui.add_folder("hold to move"):
                gui.add_html(JOG_STYLE)
                self._jogs = [(gui.add_button(" "), i, sign) for i in range(self._most_axes) for sign in (-1.0, 1.0)]
            for button, i, sign in self._jogs:
                JogButton(button, self._here, self._desk, self._seen, partial(self._jog, i, sign), self._say)
            self._point = gui.add_text("point", "")
            go = gui.add_button("Go to the point")
            JogButton(go, self._here, self._desk, self._seen, self._go, self._say)
        self._show_axes()

    @property
    def _most_axes(self) -> int:
        return max([len(TOOL_AXES), *(len(each.names) for each in self._axes.values())])

    def _show_axes(self) -> None:
        """The buttons are those of the chosen robot and frame."""
        names = self._jog_axes()
        for button, i, sign in self._jogs:
            button.visible = i < len(names)
            button.label = f"{names[i]} {'+' if sign > 0.0 else '−'}" if i < len(names) else " "  # noqa: RUF001

    def _jog_axes(self) -> tuple[str, ...]:
        if self._frame.value != JOINTS:
            return TOOL_AXES
        return self._axes[self._robot.value].names if self._robot.value in self._axes else ()

    def _jog(self, i: int, sign: float) -> tuple[str, Jog] | None:
        """What holding a button asks for: axis `i` of those that are shown."""
        names, frame = self._jog_axes(), self._frame.value
        if i >= len(names) or not self._control.may(self._visitor):
            return None
        robot = self._robot.value
        straight = names[i] in "XYZ" if frame != JOINTS else self._axes[robot].sliding[i]
        speed = sign * self._speed.value / 100.0 * (FASTEST_M_S if straight else FASTEST_RAD_S)
        own = {each.value: each for each in JogFrame}
        in_frame = frame if frame != JOINTS and frame not in own else None
        return robot, Jog("", names[i], speed, own.get(frame, JogFrame.WORLD), None, in_frame)

    def _go(self) -> tuple[str, Go] | None:
        point = self._point.value.strip()
        return (self._robot.value, Go("", point)) if point and self._control.may(self._visitor) else None

    def _build_cell(self) -> None:
        gui = self._gui
        with gui.add_folder("Cell"):
            gui.add_button("Reset all: end the shown stops, acknowledge faults").on_click(self._reset_all)
            flag = gui.add_number("flag", 0, min=0, max=999, step=1)
            answer = gui.add_button("Answer the flag")
            answer.on_click(self._gives(lambda _: AnswerFlag(int(flag.value))))
            if not self._settings.zones:
                return
            zone = gui.add_dropdown("zone", tuple(self._settings.zones))
            looked = gui.add_checkbox("I have looked: nobody is inside", initial_value=False)
            gui.add_button("Clear the zone").on_click(lambda _: self._clear(zone, looked))
            adopt = gui.add_button("Let the robot adopt the zone")
            adopt.on_click(lambda _: self._adopt(zone.value))

    def _adopt(self, zone: Name) -> None:
        self._ask_manager(AdoptZone(zone, self._robot.value, self._desk.operator))

    def _clear(self, zone: Any, looked: Any) -> None:
        if not looked.value:
            self._say("look first whether anybody is inside, and say so with the box above")
            return
        looked.value = False
        self._ask_manager(ClearZone(zone.value, self._desk.operator))

    def _build_configure(self) -> None:
        gui = self._gui
        with gui.add_folder("Teach, inputs, outputs"):
            replace = gui.add_checkbox("a point of this name may be there", initial_value=False)
            teach = gui.add_button("Teach the point here")
            teach.on_click(self._gives(lambda _: self._taught(replace.value), Level.CONFIGURE))
            name = gui.add_text("input or output", "")
            force = gui.add_button_group("force the input", ("on", "off", "follow"))
            forced = {"on": True, "off": False, "follow": None}
            force.on_click(
                self._gives(lambda event: ForceInput(name.value.strip(), forced[event.target.value]), Level.CONFIGURE)
            )
            switch = gui.add_button_group("switch the output", ("on", "off", *_FORCES))
            switch.on_click(lambda event: self._switch(name.value.strip(), event.target.value))

    def _taught(self, replace: bool) -> Teach:
        return Teach(self._point.value.strip(), PointKind.POSE, None, replace)

    def _switch(self, output: str, how: str) -> None:
        robot = self._robot.value
        gateway = self._settings.robots[robot].gateway
        state = self._seen.last(GatewayState, gateway)
        if state is None:
            self._say(f"gateway {gateway} does not answer")
            return
        by = self._desk.operator
        order = (
            ForceOutput(robot, output, _FORCES[how], by)
            if how in _FORCES
            else SwitchOutput(robot, output, how == "on", by)
        )
        self._ask(f"gateway/{gateway}", order, Heard(state[0].boot, state[0].sequence), Level.CONFIGURE)
