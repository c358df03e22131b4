"""One program line on its way to the drives: the functions that hand it on are called in this order, and the page that
shows them to readers is made from this list.

python -m tests.sim.test_sim_route > docs/route.md
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

from cell.messages import Enable, Mode, Run
from tests.sim.network import Weather
from tests.sim.world import World, load_bundle
from tests.unit.config_world import Copy

ROOT = Path(__file__).parents[2]
MOST_FILES = 60
PROGRAM = "ML Z=1300 F=300\nEND\n"


@dataclass(frozen=True, slots=True)
class Hop:
    """A function that has the line, as it is by then, and hands it on."""

    file: str
    function: str
    gives: str


@dataclass(frozen=True, slots=True)
class Stretch:
    """What one process does with it."""

    title: str
    hops: tuple[Hop, ...]


ROUTE = (
    Stretch(
        "The agent reads the program and begins it",
        (
            Hop("robot_agent/language/parser.py", "parse_program", "the program, or all its mistakes at once"),
            Hop("robot_agent/language/words.py", "named_numbers", "the words of the line as numbers with units"),
            Hop("robot_agent/agent/operator/operator.py", "OperatorCalls._decide", "the call, if it is young enough"),
            Hop("robot_agent/agent/operator/decisions.py", "Decisions.decide", "yes or no, and why not"),
            Hop("robot_agent/agent/program/program_run.py", "ProgramRun.start", "the program from its first line"),
            Hop("robot_agent/agent/planning/reading.py", "ReadAhead._read", "what comes next, ahead of the motion"),
            Hop("robot_agent/language/interpreter.py", "Interpreter.next", "the next step of the program"),
            Hop("robot_agent/language/moves.py", "MoveLine.run", "a step: where the TCP goes, and how fast"),
            Hop("robot_agent/agent/planning/joining.py", "StraightOn.take", "the moves that become one motion with it"),
        ),
    ),
    Stretch(
        "A process of its own plans the motion",
        (
            Hop("robot_agent/agent/planning/planner.py", "Planner.plan", "the motion, its body and its zones"),
            Hop("robot_agent/paths/line.py", "Line.__post_init__", "the line as geometry"),
            Hop("robot_agent/paths/sequence.py", "Sequence.__init__", "all moves of the motion, in order"),
            Hop("robot_agent/trajectory/planner.py", "plan", "the trajectory"),
            Hop("robot_agent/paths/legs.py", "legs", "a straight way and a turn, from where the robot is"),
            Hop("robot_agent/paths/pose_path.py", "pose_paths", "poses over the way, corners rounded"),
            Hop("robot_agent/trajectory/joints/follow.py", "follow", "joints over the way"),
            Hop("robot_agent/paths/chain.py", "CurveChain.at", "poses at places on the way"),
            Hop("robot_agent/kinematics/tracking.py", "track", "one branch of the inverse, without a jump"),
            Hop("robot_agent/kinematics/families/six_axis.py", "SixAxis.inverse", "all joints that reach a pose"),
            Hop("robot_agent/kinematics/families/six_axis_inverse.py", "solve_arm", "shoulder, elbow and wrist"),
            Hop("robot_agent/trajectory/timing/dispatch.py", "in_time", "the way over time"),
            Hop("robot_agent/trajectory/timing/path_limits.py", "PathLimits.rows", "limits of the way's speed"),
            Hop("robot_agent/trajectory/timing/optimal/time_optimal.py", "begin", "the fastest way within them"),
            Hop("robot_agent/trajectory/timing/optimal/interior_point.py", "Search.run", "the search for it"),
            Hop("robot_agent/trajectory/timing/optimal/timing_law.py", "TimingLaw.timed", "time over the way"),
            Hop("robot_agent/trajectory/assembly.py", "assembled", "joints over time: the motion"),
            Hop("robot_agent/workspace/swept_body.py", "sweep", "the robot's capsules all along it"),
            Hop("robot_agent/workspace/zones.py", "crossings", "where it enters and leaves zones"),
        ),
    ),
    Stretch(
        "The agent sends a block every 20 ms, and says before where it leads",
        (
            Hop("robot_agent/agent/step/doing.py", "Running.wishes", "what is wanted of the next block"),
            Hop("robot_agent/agent/zones/zone_claims.py", "ZoneClaims.holds_on", "zones that it may not enter yet"),
            Hop("robot_agent/agent/blocks/executive.py", "Executive.next_block", "the block that joins what is played"),
            Hop("robot_agent/agent/blocks/sources.py", "GovernedPath.begin", "the motion as the source of it"),
            Hop("robot_agent/trajectory/governor/governor.py", "Governor.next", "how fast planned time advances"),
            Hop("robot_agent/trajectory/governor/one_way.py", "OneWay.towards", "a segment one way, and its ramp"),
            Hop("robot_agent/trajectory/governor/steering.py", "Steering.change", "a change of that rate within jerk"),
            Hop("robot_agent/trajectory/governor/rate_law.py", "RateLaw.of_pieces", "the rate over time"),
            Hop("robot_agent/trajectory/governor/sampler.py", "Sampler._segment", "samples up to rest"),
            Hop("robot_agent/trajectory/governor/travel.py", "Travel.sampled", "joints at those samples"),
            Hop("robot_agent/workspace/body.py", "body_message", "the body from here to rest"),
            Hop("robot_agent/agent/zones/announcer.py", "Announcer.presence", "the presence, published first"),
            Hop("robot_agent/agent/blocks/timeline.py", "Timeline.sent", "what was sent, for the block after it"),
            Hop("robot_agent/agent/drives/axes.py", "samples_in_axes", "joints as axes of the drives"),
            Hop("cell/net/codec.py", "encode", "the block as bytes"),
            Hop("cell/net/binary.py", "encode_setpoints", "their layout"),
        ),
    ),
    Stretch(
        "The gateway plays it",
        (
            Hop("cell/net/latest.py", "Latest.take_new", "the newest block of its robot"),
            Hop("drive_gateway/gateway/core.py", "GatewayCore.receive", "the block at its robot"),
            Hop("drive_gateway/gateway/robots/robot.py", "Robot.offer", "a block of the robot's owner"),
            Hop("drive_gateway/gateway/playout/playout.py", "Playout.offer", "a block that comes in time"),
            Hop("drive_gateway/gateway/playout/joining.py", "JoinRules.join_problem", "one that joins what is played"),
            Hop("drive_gateway/gateway/robots/group.py", "DriveGroup.command", "in each cycle one sample of it"),
            Hop("drive_gateway/cia402/units.py", "AxisUnits.counts", "that in counts of the encoders"),
            Hop("drive_gateway/gateway/drives/drive.py", "Drive.command", "controlword and target of one drive"),
            Hop("drive_gateway/canopen/pdo_map.py", "ProcessImage.frames", "the frames that carry them, after SYNC"),
        ),
    ),
)  # fmt: skip
HOPS = [hop for stretch in ROUTE for hop in stretch.hops]


@contextmanager
def traced(calls: list[tuple[str, str]]) -> Iterator[None]:
    """Notes each call of a function of the route."""
    wanted = {(str(ROOT / hop.file), hop.function): (hop.file, hop.function) for hop in HOPS}

    def note(frame: FrameType, event: str, _argument: object) -> None:
        if event == "call":
            key = wanted.get((frame.f_code.co_filename, frame.f_code.co_qualname))
            if key is not None:
                calls.append(key)

    sys.setprofile(note)
    try:
        yield
    finally:
        sys.setprofile(None)


def page() -> str:
    """`docs/route.md`."""
    lines = [
        "# The way of one program line",
        "",
        "From `ML Z=1300 F=300` to the frame that moves a drive: the functions that hand the line on, in the order",
        "in which they are called. `tests/sim/test_sim_route.py` makes this page: it runs such a line, and sees that",
        "each of them is called after the one before. Zenoh, the CAN driver and the planning process are around them",
        "(`cell/net/session.py`, `drive_gateway/gateway/bus/bus_port.py`, `robot_agent/agent/planning/worker.py`).",
    ]
    for stretch in ROUTE:
        lines += ["", f"## {stretch.title}", "", "| file | function | gives |", "|---|---|---|"]
        lines += [f"| `{hop.file}` | `{hop.function}` | {hop.gives} |" for hop in stretch.hops]
    return "\n".join(lines) + "\n"


def test_a_line_goes_this_way_from_the_text_to_the_frames(tmp_path: Path) -> None:
    copy = Copy(tmp_path).slow_buses()
    (copy.cell.parent / "programs" / "left.prog").write_text(PROGRAM)
    calls: list[tuple[str, str]] = []
    bundle = load_bundle(copy.cell)
    with traced(calls):
        world = World(bundle, 1, Weather(loss=0.0, double=0.0, late=0.0))
    world.clock.run_until(world.clock.now + 20.0, lambda: mode(world) is Mode.DISABLED)
    world.operate("robot/left", Enable())
    assert world.clock.run_until(world.clock.now + 20.0, lambda: mode(world) is Mode.READY)
    with traced(calls):
        world.operate("robot/left", Run())
        assert world.clock.run_until(world.clock.now + 20.0, lambda: moves(world))
    left = iter(calls)
    missed = next((hop for hop in HOPS if (hop.file, hop.function) not in left), None)
    assert missed is None, f"{missed} is not called after what stands before it"


def test_the_way_passes_few_files_and_none_twice() -> None:
    files = [hop.file for hop in HOPS]
    assert len(files) == len(set(files)) <= MOST_FILES


def test_the_page_shows_this_way() -> None:
    assert (ROOT / "docs" / "route.md").read_text() == page()


def mode(world: World) -> Mode | None:
    state = world.seen.robots.get("left")
    return None if state is None else state.mode


def moves(world: World) -> bool:
    return bool(abs(world.seen.feedback["left"].velocity).max() > 1e-3)


if __name__ == "__main__":
    print(page(), end="")
