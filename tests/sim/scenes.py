"""Whole cells in which one certain thing happens that generated cells hardly ever come to; judged as these are.

python -m tests.sim.scenes --seeds 0:8
"""

import logging
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Collection
from functools import partial
from pathlib import Path

import numpy as np

from cell.geometry import capsule_distance
from cell.messages import (
    Command,
    Continue,
    Disable,
    Enable,
    Estop,
    Halt,
    Mode,
    ProgramState,
    Run,
    Token,
    ZoneState,
    ZoneStatus,
)
from drive_gateway.gateway.bus.bus_news import SecondMaster
from drive_gateway.sim.axis.servo import Servo
from robot_agent.workspace import FOLLOWING_M
from tests.sim.apart_cell import QUIET, apart_cell
from tests.sim.cells import MODELS
from tests.sim.checker import search
from tests.sim.faults import Pushed
from tests.sim.item import Stage
from tests.sim.jog_key import hold_key
from tests.sim.judge import ALL, Broken, Judge
from tests.sim.judge.bodies import BodyIsPublished
from tests.sim.judge.grants import FirstComeFirstServed
from tests.sim.staff import Staff
from tests.sim.two_zones import PAUSE, two_zones
from tests.sim.world import World, load_bundle
from tests.unit.config_world import Copy


class Scene:
    """A cell on links that lose nothing, its judge, and people who bring all programs to their ends, if there are."""

    def __init__(self, cell: Path, *, staffed: bool = True, only: Collection[str] | None = None) -> None:
        """`only`: the invariants that are looked at; None: all."""
        self.world = World(load_bundle(cell), 0, QUIET)
        self.facts = Judge(self.world, only).facts
        self.staff = Staff(self.world, self.facts)
        self.staff.endless, self.staff.working = False, staffed
        self.until("all robots are heard", lambda: len(self.world.seen.robots) == len(self.facts.robots))

    def until(self, what: str, done: Callable[[], bool], longest_s: float = 20.0) -> None:
        """Raises `Broken` when it does not come to that."""
        clock = self.world.clock
        if not clock.run_until(clock.now + longest_s, done):
            states = self.world.seen.robots.values()
            waits = "; ".join(f"{state.robot} is {state.mode.value}, {state.waiting_for}" for state in states)
            raise Broken(what, clock.now - self.facts.start, ", ".join(self.facts.robots), waits)

    def order(self, robot: str, command: Command, then: Mode) -> None:
        """A call, until it has brought the robot into a mode."""
        self.world.operate(f"robot/{robot}", command)
        self.until(f"{robot} is {then.value}", lambda: self.mode(robot) is then)

    def mode(self, robot: str) -> Mode:
        return self.world.seen.robots[robot].mode

    def line(self, robot: str) -> int:
        return self.world.seen.robots[robot].program.line

    def waits(self, robot: str) -> str:
        return self.world.seen.robots[robot].waiting_for

    def zone(self, name: str) -> ZoneStatus:
        assert self.world.seen.manager is not None
        return self.world.seen.manager.zones[name]

    def occupied(self, zone: str) -> bool:
        return self.zone(zone).state is ZoneState.OCCUPIED

    def fastest(self, robot: str) -> float:
        """How fast its fastest axis is measured [rad/s or m/s]."""
        return float(abs(self.facts.feedback[robot].velocity).max())

    def apart_m(self, one: str, other: str) -> float:
        """How far their bodies are apart, by the simulated drives."""
        facts, models = self.facts, self.world.models
        its, others = (facts.points(robot, facts.measured(robot)[None])[0] for robot in (one, other))
        radii = models[one].capsule_radii[:, None], models[other].capsule_radii
        return float(capsule_distance(its[:, None], radii[0], others, radii[1]).min())

    def servos(self, robot: str) -> list[tuple[Servo, float]]:
        """Of its axes, with their counts per [rad or m]."""
        nodes = self.world.buses[self.facts.gateway_of(robot)].nodes
        axes = self.world.bundle.gateways[self.world.cell.robots[robot].gateway].robots[robot].axes
        return [(nodes[axis.node_id].drives[axis.number - 1].servo, axis.counts_per_unit) for axis in axes]

    def done(self, longest_s: float = 40.0) -> None:
        """Until all programs have come to their ends."""
        states = self.world.seen.robots.values
        self.until(
            "everyone is done in the end",
            lambda: all(state.program.state is ProgramState.DONE for state in states()),
            longest_s,
        )


_NEARER_M = 0.002
"""A drive that settles moves its robot by less."""
BESIDE = """MJ J1={turn:g} J2=-12 J3=65 J4=0 J5=37 J6=0 F=100
ML X=1720 Y={y:g} Z=1250 A=0 B=90 C=0 F=1000
"""


def pushed_too_near(folder: Path) -> None:
    """An arm is pushed by hand to less than the margin from another one: that one comes no nearer, and goes on when the
    first has gone back."""
    right, left = BESIDE.format(turn=0, y=0), BESIDE.format(turn=20, y=650) + "WAIT 1\nML Y=500 F=300\n"
    scene = Scene(apart_cell(folder, {"right": right, "left": left}))
    scene.until("left stands beside right", lambda: scene.line("left") == 3)
    scene.world.operate("robot/left", Halt())
    scene.staff.leave_alone("left", 5.0)
    Pushed(0.0, None, "anna", "right", -0.4).strike(Stage(scene.world, scene.facts, scene.staff, set()))
    scene.until("left is halted", lambda: scene.mode("left") is Mode.HALTED)
    scene.until("left goes on", lambda: scene.mode("left") is Mode.RUNNING)
    apart_m = scene.apart_m("left", "right")
    scene.until("right is in left's way", lambda: scene.waits("left").startswith("left's link"))
    scene.world.clock.run_until(scene.world.clock.now + 2.0)
    if scene.apart_m("left", "right") < apart_m - _NEARER_M:
        raise Broken("robots that are too near only part", scene.world.clock.now - scene.facts.start, "left", "nearer")
    scene.order("right", Enable(), Mode.READY)
    scene.order("right", Run(), Mode.RUNNING)
    scene.done()


ASIDE = "MJ J1=24 J2=-12 J3=65 J4=0 J5=37 J6=0 F=100\nML X=1736 Y=773 Z=1250 A=0 B=90 C=0 F=1000\n"
INTO_IT = "MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0 F=100\nML X=2150 Y=0 Z=1250 A=0 B=90 C=0 F=1200\nHOME F=60\n"


def pushed_unheard(folder: Path) -> None:
    """An arm whose agent is off is pushed into room that another one has been cleared, and drives in: when its agent
    is started again, all are stopped at once."""
    scene = Scene(apart_cell(folder, {"left": INTO_IT, "right": ASIDE}), staffed=False, only=())
    world, clock = scene.world, scene.world.clock
    for robot in scene.facts.robots:
        scene.until(f"{robot} is off", lambda robot=robot: scene.mode(robot) is Mode.DISABLED)
        scene.order(robot, Enable(), Mode.READY)
    scene.order("right", Run(), Mode.RUNNING)
    scene.until("right is aside", lambda: scene.mode("right") is Mode.READY)
    clock.run_until(clock.now + 1.0)
    scene.order("right", Disable(), Mode.DISABLED)
    clock.run_until(clock.now + 1.0)
    world.kill("robot/right")
    clock.run_until(clock.now + 3.0)
    servo, counts_per_rad = scene.servos("right")[0]
    servo.jump(round(-np.radians(24.0) * counts_per_rad))
    scene.order("left", Run(), Mode.RUNNING)
    scene.until("left is on its way there", lambda: scene.line("left") == 2)
    clock.run_until(clock.now + 0.3)
    world.start_agent("right")
    scene.until("left is stopped", lambda: scene.mode("left") is Mode.ESTOP, 2.0)


def drives_that_sag(folder: Path) -> None:
    """Drives without integral action hold their axes a little below where they are told, within what a robot may follow
    behind; on ways of a few millimetres that is more than the way."""
    program = BESIDE.format(turn=0, y=0) + "".join(f"WAIT 0.2\nML Z={1250 + 4 * k} F=500\n" for k in (1, 0, 1, 0))
    scene = Scene(apart_cell(folder, {"left": program + "HOME F=50\n", "right": "WAIT 1\n"}))
    _sag(*scene.servos("left")[1])
    scene.done()


def _sag(servo: Servo, counts_per_rad: float) -> None:
    """From now on slowly more, up to 9 mm with the arm reaching out 1.9 m."""
    interpolate, by = servo.interpolate, 0.0

    def sagging(target: float, period_s: float) -> None:
        nonlocal by
        by = min(by + 0.005 * period_s, 0.9 * FOLLOWING_M / 1.9)
        interpolate(target + by * counts_per_rad, period_s)

    servo.interpolate = sagging  # type: ignore[method-assign]


UP_AND_DOWN = "MJ J1=10 J2=10 J3=10\nML Z=-750 F=2000\n" + "".join(
    f"ML Z={-750 + stroke}\nML Z=-750\n" for stroke in (20, 30, 40, 50, 60, 70, 80, 90, 100, 120)
)
"""Strokes of many lengths: for some of them the drives are just behind the turn."""


def drives_behind(cycles: int, folder: Path) -> None:
    """A delta robot so fast that its drives are on the way there yet while they are commanded to the way back."""
    scene = Scene(_deltas(folder, {"fast": UP_AND_DOWN, "other": "WAIT 1\n"}))
    for servo, _ in scene.servos("fast"):
        _delay(servo, cycles)
    scene.done()


def _delay(servo: Servo, cycles: int) -> None:
    """Set points count so much later, as by a filter that smooths them."""
    interpolate, coming = servo.interpolate, deque[float]()

    def delayed(target: float, period_s: float) -> None:
        coming.append(target)
        interpolate(coming.popleft() if len(coming) > cycles else coming[0], period_s)

    servo.interpolate = delayed  # type: ignore[method-assign]


def _deltas(folder: Path, programs: dict[str, str], zones: str = "", cycle_s: float = 0.004) -> Path:
    """A cell of delta robots, 3 m from each other, whose drives are far behind."""
    gateways, robots = list[str](), list[str]()
    for number, (name, program) in enumerate(programs.items()):
        (folder / f"{name}.prog").write_text(program)
        (folder / f"{name}.yaml").write_text(
            DRIVES.replace("NAME", name).replace("cycle_s: 0.004", f"cycle_s: {cycle_s}")
        )
        gateways.append(f'  {name}: {{endpoint: "tcp/127.0.0.1:{7451 + number}", drives: {name}.yaml}}')
        base = f"{{X: {3000 * number}, Y: 0, Z: 2000, A: 0, B: 0, C: 0}}"
        robots.append(f"  {name}: {{model: {MODELS}/delta.yaml, gateway: {name}, base: {base}, program: {name}.prog}}")
    cell = folder / "cell.yaml"
    cell.write_text("\n".join([CELL, "gateways:", *gateways, "robots:", *robots, zones]))
    return cell


CELL = """cell: deltas
units: {length: mm, angle: deg}
manager: {endpoint: "tcp/127.0.0.1:7450"}"""
DRIVES = """units: {length: mm, angle: deg}
bus: {interface: virtual, channel: NAME, bitrate: 1000000}
cycle_s: 0.004
overrun_limit_s: 0.06
heartbeat_producer_s: 0.1
heartbeat_timeout_s: 0.6
tpdo_timeout_s: 0.2
boot_timeout_s: 5
robots:
  NAME:
    axes:
      J1: {node: 1, gear: 30, counts_per_turn: 131072, direction: 1, offset: 0, speed: 660, acceleration: 13200,
           quick_stop: 17000, following_window: 66, following_time_s: 0.1}
      J2: {node: 2, gear: 30, counts_per_turn: 131072, direction: 1, offset: 0, speed: 660, acceleration: 13200,
           quick_stop: 17000, following_window: 66, following_time_s: 0.1}
      J3: {node: 3, gear: 30, counts_per_turn: 131072, direction: 1, offset: 0, speed: 660, acceleration: 13200,
           quick_stop: 17000, following_window: 66, following_time_s: 0.1}
      J4: {node: 4, gear: 8, counts_per_turn: 131072, direction: 1, offset: 0, speed: 1320, acceleration: 16500,
           quick_stop: 20000, following_window: 132, following_time_s: 0.1}
"""


IN_AND_OUT = "MJ J1=10 J2=10 J3=10 F=50\nLABEL again\nML Z=-750 F=500\nML Z=-600\nWAIT 0.7\nGOTO again 5\n"
SHARED = """zones:
  low:
    box: [9000, 2000, 300]
    pose: {X: 3000, Y: 0, Z: 1200, A: 0, B: 0, C: 0}
    of: tcp
    robots: [often, again, seldom]
    priority: {often: 2, again: 2}
"""


def overtaken(folder: Path) -> None:
    """Two robots that go before a third one want a zone in turn, so that one of them always waits for it. The third one
    is overtaken as often as priorities differ, and by those that came before it."""
    programs = {"often": IN_AND_OUT, "again": IN_AND_OUT, "seldom": f"WAIT 1\n{IN_AND_OUT}"}
    only = [each.name for each in ALL if each is not FirstComeFirstServed]
    scene = Scene(_deltas(folder, programs, SHARED, cycle_s=0.016), only=only)
    scene.until("seldom waits for a zone", lambda: "seldom" in scene.zone("low").queue)
    tokens = set[Token | None]()

    def has_it() -> bool:
        tokens.add(scene.zone("low").token)
        return scene.zone("low").holder == "seldom"

    scene.until("seldom has it", has_it)
    if len(tokens) > 5:  # its own, those of the two who were there before it, and two for the two priorities
        others = f"{len(tokens) - 1} others had it before"
        raise Broken("nobody is overtaken for ever", scene.world.clock.now - scene.facts.start, "seldom", others)


def halted_in_a_zone(folder: Path) -> None:
    """Where robots are kept apart, one that is halted in the first of two zones keeps its way out through the other."""
    scene = Scene(two_zones(folder, "", PAUSE, ordered=True, feed=500), staffed=False)
    for robot in scene.facts.robots:
        scene.until(f"{robot} is off", lambda robot=robot: scene.mode(robot) is Mode.DISABLED)
        scene.order(robot, Enable(), Mode.READY)
    scene.order("left", Run(), Mode.RUNNING)
    scene.until("left is inside", lambda: scene.occupied("north"))
    scene.world.clock.run_until(scene.world.clock.now + 0.3)  # it is in there to stay, and not only touches it
    scene.order("left", Halt(), Mode.HALTED)
    scene.until("left wants no second zone", lambda: scene.zone("south").state is ZoneState.FREE)
    scene.order("right", Run(), Mode.RUNNING)
    scene.until("right waits for left to get through", lambda: "left must get through" in scene.waits("right"))
    scene.world.clock.run_until(scene.world.clock.now + 2.0)
    scene.order("left", Continue(), Mode.RUNNING)
    scene.done()


def stood_still(folder: Path) -> None:
    """A manager, and an agent, that stand still for less time than a presence is fresh for have to hear new ones."""
    cell = two_zones(folder, "", PAUSE)
    cell.write_text(cell.read_text().replace("times: {", "times: {fresh_s: 0.6, "))
    scene = Scene(cell)
    for seconds in (0.3, 0.4, 0.5):
        for process in ("manager", "robot/left", "robot/right"):
            scene.until("somebody is in a zone", lambda: any(map(scene.occupied, ("north", "south"))))
            scene.world.freeze(process, seconds)
            scene.world.clock.run_until(scene.world.clock.now + 2.0 * seconds)
    scene.done()


SWINGS = (
    "MJ J1=0 J2=0 J3=20 J4=0 J5=37 J6=0 F=100\n"
    "LABEL again\nMJ J1=60 J2=60 F=100\nMJ J1=-60 J2=-60 F=100\nGOTO again 1\nHOME F=50\n"
)
_HARDWARE, _GENERIC = 0x5000, 0x01


def stopped_unheard(folder: Path) -> None:
    """A node reports an error and goes on, so all drives of the arm brake, each as hard as it can. Two do that much
    harder than the others, which leads off the path; and the agent stands still, and does not say so. Nor does the body
    that it has published before: what it owns is what holds."""
    cell = apart_cell(folder, {"left": SWINGS, "right": "WAIT 1\n"}, drives=_two_brake_harder)
    scene = Scene(cell, only=[each.name for each in ALL if each is not BodyIsPublished])
    clock, facts = scene.world.clock, scene.facts
    nodes = list(scene.world.buses[facts.gateway_of("left")].nodes.values())
    for node in nodes[:2]:
        scene.until("left swings", lambda: scene.mode("left") is Mode.RUNNING and scene.fastest("left") > _FAST)
        clock.run_until(clock.now + 0.12)
        scene.world.freeze("robot/left", 0.6)
        clock.run_until(clock.now + 0.02)
        node.emergencies.say(_HARDWARE, _GENERIC)
        clock.run_until(clock.now + 1.0)
        node.emergencies.say(0, 0)
    scene.done()


_FAST = 1.5
"""[rad/s]"""


def _two_brake_harder(copy: Copy) -> None:
    for deceleration in (550, 650):
        copy.change("two_arms/left_drives.yaml", f"quick_stop: {deceleration}", "quick_stop: 4000")


def wanted_while_stopped(folder: Path) -> None:
    """Somebody to whom all of the robot comes late wants its drives on, when another one has just ended the emergency
    stop."""
    scene = Scene(apart_cell(folder, {"left": SWINGS, "right": "WAIT 1\n"}))
    world = scene.world
    world.operator("anna")
    scene.until("left swings", lambda: scene.mode("left") is Mode.RUNNING and scene.fastest("left") > _FAST)
    scene.staff.working = False
    world.raise_estop(Estop("drawn", True, "bert", "drawn"), "bert")
    scene.until("all is off", lambda: all(each.estop_confirmed for each in world.seen.gateways.values()))
    world.network.delay("robot/left", "anna", 0.5, 0.5)
    scene.staff.reset_estop("bert")
    scene.until("the stop is over", lambda: not any(each.estop_confirmed for each in world.seen.gateways.values()))
    world.operate("robot/left", Enable(), "anna")
    world.clock.run_until(world.clock.now + 0.2)
    scene.staff.working = True
    scene.done()


def two_masters(folder: Path) -> None:
    """Somebody else sends what only the gateway may: the robot is stopped, and goes on when people have looked."""
    scene = Scene(apart_cell(folder, {"left": SWINGS, "right": "WAIT 1\n"}))
    port = scene.world.buses[scene.facts.gateway_of("left")].port
    assert port is not None
    scene.until("left swings", lambda: scene.mode("left") is Mode.RUNNING and scene.fastest("left") > _FAST)
    port.tell(SecondMaster("somebody else sends 201h"))
    scene.until("left is in a fault", lambda: scene.mode("left") is Mode.FAULT, 1.0)
    scene.done()


def lost_blocks(folder: Path) -> None:
    """Four blocks are lost, one after another: what the gateway has got before is enough to go on as fast."""
    scene = Scene(apart_cell(folder, {"left": "MJ J1=80 F=50\nMJ J1=-80 F=50\nHOME F=50\n", "right": "WAIT 1\n"}))
    clock, gateway = scene.world.clock, scene.facts.gateway_of("left")
    scene.until("left is on the way back", lambda: scene.line("left") == 2 and scene.fastest("left") > _STEADY)
    for wait_s in (0.3, 0.305, 0.31, 0.315):
        clock.run_until(clock.now + wait_s)
        scene.world.network.cut("robot/left", gateway, 0.08)
        if clock.run_until(clock.now + 0.2, lambda: scene.fastest("left") < _STEADY):
            raise Broken("lost blocks do not slow a robot", clock.now - scene.facts.start, "left", "slower")
    scene.done()


def vanished_operator(folder: Path) -> None:
    """Somebody who holds a jog key vanishes: the robot stands soon."""
    scene = Scene(apart_cell(folder, {"left": BESIDE.format(turn=0, y=0) + "WAIT 1\n", "right": "WAIT 1\n"}))
    clock = scene.world.clock
    scene.world.operator("anna")
    scene.until("left waits", lambda: scene.line("left") == 3)
    scene.staff.leave_alone("left", 5.0)
    scene.order("left", Halt(), Mode.HALTED)
    hold_key(scene.world, "anna", "left", "Z", 0.05, 0.5, lets_go=False)
    scene.until("left is jogged", lambda: scene.mode("left") is Mode.JOGGING and scene.fastest("left") > _CRAWLS)
    clock.run_until(clock.now + 0.5)
    scene.until("left stands when nobody holds the key", lambda: scene.mode("left") is not Mode.JOGGING, 1.0)
    scene.done()


def jogged_at_another(folder: Path) -> None:
    """A jog key is held although another arm is in the way: the jog stands in front of what that may use."""
    right, left = BESIDE.format(turn=0, y=0), BESIDE.format(turn=20, y=650) + "WAIT 1\n"
    scene = Scene(apart_cell(folder, {"right": right, "left": left}))
    scene.world.operator("anna")
    scene.until("left stands beside right", lambda: scene.line("left") == 3)
    scene.staff.leave_alone("left", 8.0)
    scene.order("left", Halt(), Mode.HALTED)
    hold_key(scene.world, "anna", "left", "Y", -0.2, 4.0, lets_go=True)
    scene.until("left is jogged", lambda: scene.mode("left") is Mode.JOGGING and scene.fastest("left") > _CRAWLS)
    scene.until("left stands in front of right", lambda: scene.fastest("left") < _CRAWLS, 3.5)
    if scene.mode("left") is not Mode.JOGGING:
        raise Broken(
            "a jog stands in front of another robot", scene.world.clock.now - scene.facts.start, "left", "over"
        )


_CRAWLS = 0.005
"""[rad/s]"""
_STEADY = 0.95
"""[rad/s] Half of what its J1 may do is 0.96."""


SCENES: dict[str, Callable[[Path], None]] = {
    "a robot is pushed too near": pushed_too_near,
    "a robot is pushed while nobody hears it": pushed_unheard,
    "drives that sag": drives_that_sag,
    "drives a little behind": partial(drives_behind, 8),
    "drives far behind": partial(drives_behind, 20),
    "halted in a zone": halted_in_a_zone,
    "processes that stand still": stood_still,
    "drives that brake unheard": stopped_unheard,
    "wanted while it was stopped": wanted_while_stopped,
    "two masters": two_masters,
    "lost blocks": lost_blocks,
    "a vanished operator": vanished_operator,
    "jogged at another one": jogged_at_another,
    "overtaken": overtaken,
}


def broken(number: int) -> tuple[str, float]:
    """What is wrong in this scene, and when."""
    name, play = list(SCENES.items())[number]
    with tempfile.TemporaryDirectory(prefix="scene-") as folder:
        try:
            play(Path(folder))
        except Broken as error:
            return f"{name}: {error.invariant}", error.at_s
    return "", 0.0


if __name__ == "__main__":
    logging.disable(logging.CRITICAL)
    sys.exit(search("whole cells in which one certain thing happens", broken))
