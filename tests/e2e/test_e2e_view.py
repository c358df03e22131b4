"""The page in a real browser: what is seen, who may steer, and what a hand that is gone does."""

import math
import os
import re
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import pytest

pytest.importorskip("viser", reason="the group `view` is not installed")

from chromium import CHROMIUM, Chromium, Tab
from live_cell import LiveCell, Process, Recorder, wait_until
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect as websocket

from cell.messages import GatewayState, Mode, RobotState

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is found")

SHOWN_S = 40.0
"""A browser that draws without a graphics card on a busy computer."""
PRESSES = 5
DRAWS = """new Promise(done => { let left = 4; const begin = performance.now();
    const step = () => --left ? requestAnimationFrame(step) : done(performance.now() - begin < 500); step(); })"""
"""Whether the browser draws fluently; without a graphics card it first stands for seconds while it prepares to."""
SPEED_RAD_S = math.radians(6.0)
"""Of a jog at 20 %."""
STOPS_S = 0.2 + 0.2 + 0.5
"""Section 6 of the architecture: the page's bound, the agent's, and the ramp of a slow jog."""


@dataclass
class Viewed:
    """A cell that is up, and its page."""

    cell: LiveCell
    page: Process
    browser: Chromium
    states: Recorder
    addresses: dict[str, str] = field(init=False)

    def __post_init__(self) -> None:
        self.addresses = dict(re.findall(r"to (\w+): (http\S+)", self.page.output))

    def opened(self, level: str) -> Tab:
        """A tab at the address of a level, as soon as it shows the robots."""
        tab = self.browser.tab(self.addresses[level])
        shows(tab, "next:")
        wait_until(lambda: tab.js(DRAWS), SHOWN_S, "a browser that has drawn the room")
        return tab

    def in_control(self, level: str = "operate") -> Tab:
        """The same, which has control."""
        tab = self.opened(level)
        wait_until(lambda: not re.search("browser .* has control", tab.text()), SHOWN_S, "nobody else in control")
        click(tab, "Take control")
        wait_until(lambda: tab.middle_of("J1 +"), SHOWN_S, "the buttons of the jog")
        return tab

    def joint(self) -> float:
        """Where J1 of the left robot is now [rad]."""
        joints = self.state().joints
        assert joints is not None
        return joints[0]

    def state(self, robot: str = "left") -> RobotState:
        """The next state of a robot."""
        return self.states.wait_for(RobotState, lambda m: m.robot == robot, 5.0, f"a state of {robot}")


def shows(tab: Tab, words: str) -> None:
    wait_until(lambda: words in tab.text(), SHOWN_S, f"{words!r} on the page")


def click(tab: Tab, words: str) -> None:
    wait_until(lambda: tab.middle_of(words), SHOWN_S, f"a button {words!r}")
    tab.click(words)


def press(viewed: Viewed, tab: Tab) -> tuple[float, float]:
    """Hold the button of an axis until it moves; where the button is.

    Where the browser was too slow the page says so, and the button is let go and pressed again, as a hand would do.
    """
    at = tab.middle_of("J1 +")
    assert at is not None
    for _ in range(PRESSES):
        viewed.states.take()
        begin = viewed.joint()
        tab.mouse("mousePressed", at)
        with suppress(AssertionError):
            wait_until(lambda begin=begin: viewed.joint() > begin + 0.01, 3.0, "a motion")
            return at
        tab.mouse("mouseReleased", at)
    raise AssertionError(f"the axis does not move:\n{tab.text()}")


def comes_to_rest(viewed: Viewed) -> None:
    """The robot leaves jogging, which it does at rest, before it has gone farther than the time to rest allows."""
    begin = viewed.joint()
    viewed.states.wait_for(RobotState, lambda m: m.robot == "left" and m.mode is Mode.READY, 5.0, "the robot at rest")
    assert viewed.joint() - begin < SPEED_RAD_S * STOPS_S


def stays_at_rest(viewed: Viewed, states: int = 25) -> None:
    seen = [viewed.state() for _ in range(states)]
    assert {each.mode for each in seen} == {Mode.READY}
    assert all(each.tcp_speed_m_s == 0.0 for each in seen)


@contextmanager
def page_of(cell: LiveCell) -> Iterator[Viewed]:
    """A browser on the page of a cell that is up."""
    page = cell.start("cell", "view", "--control", "configure", "--port", "0", "-f", str(cell.file))
    page.wait_for_output("to watch: ", 60.0)
    with Chromium(cell.folder) as browser, cell.client() as session:
        yield Viewed(cell, page, browser, Recorder(session, "robot/*/state"))
    page.signal(signal.SIGINT)
    assert page.wait(10.0) == 0, page.output


@pytest.fixture(scope="module")
def viewed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Viewed]:
    folder: Path = tmp_path_factory.mktemp("view")
    with LiveCell(folder) as cell:
        cell.up().wait_for_output("all robots enabled", 60.0)
        with page_of(cell) as viewed:
            yield viewed


@pytest.fixture(autouse=True)
def alone(viewed: Viewed) -> Iterator[None]:
    """No test leaves a tab behind."""
    yield
    viewed.browser.close_tabs()


def test_a_button_moves_an_axis_while_it_is_held_and_no_longer(viewed: Viewed) -> None:
    tab = viewed.in_control()
    at = press(viewed, tab)
    tab.mouse("mouseReleased", at)
    comes_to_rest(viewed)
    stays_at_rest(viewed)


def test_a_tab_that_is_closed_by_force_stops_the_robot_and_gives_control_back(viewed: Viewed) -> None:
    tab = viewed.in_control()
    press(viewed, tab)
    viewed.browser.close_tab(tab)
    comes_to_rest(viewed)
    shows(viewed.opened("watch"), "next:")


def test_a_frozen_browser_stops_the_robot_which_moves_again_only_after_the_hand_was_off(viewed: Viewed) -> None:
    tab = viewed.in_control()
    at = press(viewed, tab)
    viewed.browser.signal(signal.SIGSTOP)
    try:
        comes_to_rest(viewed)
    finally:
        viewed.browser.signal(signal.SIGCONT)
    wait_until(lambda: tab.text(), SHOWN_S, "the browser back")
    stays_at_rest(viewed)
    tab.mouse("mouseReleased", at)
    tab.mouse("mouseReleased", press(viewed, tab))
    comes_to_rest(viewed)


def test_a_tab_that_is_hidden_while_a_button_is_held_stops_the_robot_which_stays_there_when_it_is_seen_again(
    viewed: Viewed,
) -> None:
    tab = viewed.in_control()
    at = press(viewed, tab)
    front = viewed.browser.tab("about:blank")
    front.call("Page.bringToFront")
    wait_until(lambda: tab.js("document.visibilityState") == "hidden", SHOWN_S, "a hidden tab")
    comes_to_rest(viewed)
    tab.call("Page.bringToFront")
    wait_until(lambda: tab.js("document.visibilityState") == "visible", SHOWN_S, "the tab in front again")
    wait_until(lambda: tab.js(DRAWS), SHOWN_S, "a browser that draws the room again")
    stays_at_rest(viewed)
    tab.mouse("mouseReleased", at)
    tab.mouse("mouseReleased", press(viewed, tab))
    comes_to_rest(viewed)


def test_an_output_is_forced_and_follows_its_program_again(viewed: Viewed) -> None:
    tab = viewed.in_control("configure")
    with viewed.cell.client() as session:
        gateways = Recorder(session, "gateway/left_bus/state")
        wait_until(lambda: tab.middle_of("force on"), SHOWN_S, "the buttons of who may configure")
        tab.write("input or output", "gripper")
        click(tab, "force on")
        gateways.wait_for(GatewayState, lambda m: "gripper" in m.forced.get("left", {}), SHOWN_S, "a forced output")
        click(tab, "Drives")
        shows(tab, "output gripper of left is FORCED by")
        click(tab, "Control")
        wait_until(lambda: tab.middle_of("follow"), SHOWN_S, "the buttons again")
        tab.click("follow", "findLast")  # the first one is that of an input
        gateways.wait_for(GatewayState, lambda m: not m.forced.get("left"), SHOWN_S, "an output that follows")


def test_who_has_no_control_has_no_buttons_until_he_takes_it(viewed: Viewed) -> None:
    first, second = viewed.in_control(), viewed.opened("operate")
    wait_until(lambda: re.search("browser .* has control", second.text()), SHOWN_S, "who has control")
    assert second.middle_of("J1 +") is None
    assert "EMERGENCY STOP" in second.text()
    take = re.search("Take control from .*", second.text())
    assert take is not None
    click(second, take[0])
    wait_until(lambda: second.middle_of("J1 +"), SHOWN_S, "the buttons of who has control now")
    wait_until(lambda: first.middle_of("J1 +") is None, SHOWN_S, "the end of the buttons of who had it")


def test_who_may_only_watch_has_no_button_at_all(viewed: Viewed) -> None:
    tab = viewed.opened("watch")
    shows(tab, "this address may only watch")
    assert "EMERGENCY STOP" not in tab.text()
    assert "Take control" not in tab.text()


def test_a_page_of_another_origin_and_one_without_the_token_get_nothing(viewed: Viewed, tmp_path: Path) -> None:
    address = viewed.addresses["operate"]
    bare, _, token = address.partition("?token=")
    assert "open the page by the whole address" in _read(viewed, bare)
    with Chromium(tmp_path) as other:
        foreign = tmp_path / "foreign.html"
        foreign.write_text("<title>foreign</title>")
        tab = other.tab(address)
        shows(tab, "next:")
        tab.open(foreign.as_uri())
        wait_until(lambda: tab.js("document.title") == "foreign", SHOWN_S, "the foreign page")
        opened = f"new Promise(done => {{ const it = new WebSocket('{bare.replace('http', 'ws')}', 'viser-v1.1.1'); "
        opened += "it.onopen = () => done('opened'); it.onerror = () => done('refused'); })"
        assert tab.js(opened) == "refused"
    for headers in ({"Origin": "http://evil.example"}, {}):
        with pytest.raises(InvalidStatus, match=r"403|401"):
            websocket(f"{bare.replace('http', 'ws')}?token={token}", additional_headers=headers)


def _read(viewed: Viewed, address: str) -> str:
    tab = viewed.browser.tab("about:blank")
    tab.call("Network.clearBrowserCookies")
    tab.open(address)
    wait_until(lambda: tab.text(), SHOWN_S, "an answer")
    return tab.text()


@pytest.mark.soak
@pytest.mark.timeout(3600)
def test_opened_and_closed_fifty_times_nothing_is_left_behind(viewed: Viewed) -> None:
    def has(what: str) -> int:
        return len(os.listdir(f"/proc/{viewed.page.pid}/{what}"))

    def memory_mb() -> float:
        status = Path(f"/proc/{viewed.page.pid}/status").read_text()
        return int(status.split("VmRSS:")[1].split()[0]) / 1024.0

    def open_and_close(times: int) -> None:
        for _ in range(times):
            tab = viewed.browser.tab(viewed.addresses["operate"])
            wait_until(lambda tab=tab: tab.middle_of("Take control"), 2.0 * SHOWN_S, "a page with its buttons")
            viewed.browser.close_tabs()

    open_and_close(10)
    wait_until(lambda: has("fd") < 40, SHOWN_S, "closed connections")
    files, threads, memory = has("fd"), has("task"), memory_mb()
    open_and_close(50)
    wait_until(lambda: has("fd") <= files, SHOWN_S, f"no open file more: {has('fd')} of {files}")
    wait_until(lambda: has("task") <= threads + 1, SHOWN_S, f"no thread more: {has('task')} of {threads}")
    assert memory_mb() - memory < 20.0
    print(f"files {files} {has('fd')}, threads {threads} {has('task')}, MB {memory:.1f} {memory_mb():.1f}")


def test_both_robots_are_seen_to_move_and_the_emergency_stop_stops_both_and_lists_them(viewed: Viewed) -> None:
    tab = viewed.opened("operate")
    viewed.cell.obeyed("run", "left", "right")
    seen: set[tuple[str, str]] = set()

    def both_went_on() -> bool:
        """Of each robot the page has shown two lines in execution."""
        seen.update(re.findall(r"(left|right) running\n(.*)", tab.text()))
        return all(len([each for each in seen if each[0] == robot]) > 1 for robot in ("left", "right"))

    wait_until(both_went_on, SHOWN_S, lambda: f"both robots going on: {seen} in\n{tab.text()}")
    click(tab, "EMERGENCY STOP")
    for who in ("robot left", "robot right", "gateway left_bus", "gateway right_bus"):
        shows(tab, f"{who} stands")
    assert len(re.findall("next: .*cell reset", tab.text())) == 2
    viewed.states.take()
    assert {viewed.state(robot).mode for robot in ("left", "right")} == {Mode.ESTOP}


def test_a_cell_that_is_ended_and_started_again_is_seen_again(tmp_path: Path) -> None:
    with LiveCell(tmp_path) as cell:
        first = cell.up()
        first.wait_for_output("all robots enabled", 60.0)
        with page_of(cell) as viewed:
            tab = viewed.opened("watch")
            first.signal(signal.SIGINT)
            first.wait(30.0)
            wait_until(lambda: "next: start its program" not in tab.text(), SHOWN_S, "that nobody answers")
            cell.up().wait_for_output("all robots enabled", 60.0)
            shows(tab, "next: start its program")
