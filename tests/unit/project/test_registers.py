"""What one module declares is known everywhere: nothing here changes a file of the product, or looks inside one.

`docs/architecture.md`, section 2.1, is about what is done here.
"""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Self
from unittest.mock import patch

import numpy as np
import pytest
import typer
from pydantic import BaseModel, Field
from typer.testing import CliRunner

from cell.commands.cell_command import COMMANDS as COMMANDS_OF_CELL
from cell.commands.cell_command import app
from cell.commands.subcommands import Subcommand
from cell.config import ConfigError
from cell.config.settings import PoseSettings, ZoneSettings
from cell.config.units import STRICT, Length
from cell.geometry import MEASURED, Box, Measured
from cell.geometry.arrays import Array
from cell.manager.occupancy import ZoneSpace
from cell.messages import (
    COMMANDS,
    STATES,
    Call,
    Command,
    Correction,
    ManagerState,
    Run,
    Urgency,
    ZoneGeometry,
    ZoneState,
    ZoneStatus,
)
from cell.messages.call import command
from cell.messages.common import Duration, Name
from cell.messages.state import state
from cell.net.codec import decode, decode_call, encode, encode_call, message_schemas
from cell.net.errors import CodecError
from cell.net.keys import Keys
from cell.net.latest import Decoder
from robot_agent.agent.planning.dry_run import dry_run
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.zones.zone_claims import ZoneClaims
from robot_agent.kinematics import SerialModel, SingularityDistance, load_model
from robot_agent.kinematics.chain import Chain, Joint
from robot_agent.kinematics.families.closed_form import ClosedForm, Raw
from robot_agent.kinematics.families.upright import heading, tilt
from robot_agent.kinematics.problems import checked_lengths
from robot_agent.language import STATEMENTS, JointStep, Move, Names, ProgramError, Statement, Switch, parse_program
from robot_agent.language.statement import Reading, Walk, statement
from robot_agent.language.words import Mistake, Word, named_numbers, percent
from robot_agent.model import FAMILIES, RobotDescription
from robot_agent.model.families import ClosedFormFile, family
from robot_agent.workspace import PlacedRobot
from tests.unit.agent_runs import enabled, ended, until
from tests.unit.manager_world import ball

WIDE = {"COLUMNS": "120"}

# A message, and a command of a call


@dataclass(frozen=True, slots=True)
class ToolWear:
    """How long a tool has worked."""

    robot: Name
    tool: Name
    worked_s: Duration


@dataclass(frozen=True, slots=True)
class ChangeTool(Command):
    verb = "change_tool"
    tool: Name


@pytest.fixture
def messages() -> Iterator[None]:
    with patch.dict(STATES), patch.dict(COMMANDS["robot"]):
        state("robot/{robot}/wear/{tool}", Urgency.HIGH)(ToolWear)
        command("robot")(ChangeTool)
        yield


WEAR = ToolWear("left", "gripper", 7.5)
KEY = "cell/two_arms/robot/left/wear/gripper"


@pytest.mark.usefixtures("messages")
def test_a_message_travels_on_its_key() -> None:
    keys = Keys("two_arms")
    assert (keys.of(WEAR), keys.type_of(KEY)) == (KEY, ToolWear)
    assert Decoder(keys).decode(KEY, encode(WEAR)) == WEAR


@pytest.mark.usefixtures("messages")
def test_a_message_is_as_strict_as_all_and_has_a_schema() -> None:
    with pytest.raises(CodecError, match="worked_s"):
        decode(ToolWear, encode(WEAR).replace(b"7.5", b"-7.5"))
    assert set(message_schemas()["ToolWear"]["properties"]) == {"robot", "tool", "worked_s"}


@pytest.mark.usefixtures("messages")
def test_a_command_is_called_by_its_verb() -> None:
    call = Call("1", ChangeTool("gripper"))
    assert decode_call("robot/left", "change_tool", encode_call(call)) == call
    with pytest.raises(CodecError, match="verb 'change_tool' is unknown to manager"):
        decode_call("manager", "change_tool", encode_call(call))


# A kinematic family


class PortalGeometry(BaseModel):
    """Length of a portal: three slides along X, Y and Z of the base, then an axis that turns the flange about Z."""

    model_config = STRICT
    a1z: Length = Field(description="base to the slides, along Z")


class Portal(ClosedForm, SerialModel):
    branches: ClassVar[tuple[str, ...]] = ("ONLY",)
    slots: ClassVar[tuple[int, ...]] = (1,)

    def __init__(self, description: RobotDescription) -> None:
        self._a1z = checked_lengths(description)["a1z"]
        slides = Joint(0, (0, 0, self._a1z), linear=True), Joint(1, linear=True), Joint(2, linear=True)
        super().__init__(description, Chain((*slides, Joint(2))))

    def singularity(self, q: Array) -> SingularityDistance:
        return SingularityDistance(("none",), np.ones((*q.shape[:-1], 1)))

    def branches_of(self, elements: Array, held: Array) -> Raw:  # noqa: ARG002
        x, y, z = elements[:3, 3]
        return Raw((x, y, z - self._a1z, heading(elements)), np.zeros(len(x)), np.zeros(len(x), bool), tilt(elements))


FILE = """
name: PORTAL
family: portal
units: {length: mm, angle: deg}
geometry: {a1z: 1500}
joints:
  J1: {type: linear, position: [0, 2000], speed: 1000, acceleration: 5000}
  J2: {type: linear, position: [0, 1000], speed: 1000, acceleration: 5000}
  J3: {type: linear, position: [-800, 0], speed: 1000, acceleration: 5000}
  J4: {position: [-360, 360], speed: 400, acceleration: 2000}
ramp_factor: 1.5
path: {speed: 1000, acceleration: 5000, angular_speed: 400, angular_acceleration: 2000}
home: {J1: 500, J2: 500, J3: -100, J4: 90}
capsules:
  - {link: 4, start: [0, 0, 0], end: [0, 0, 100], radius: 50}
"""


@pytest.fixture
def portal(tmp_path: Path) -> Iterator[Path]:
    """A robot file of a family that is known for one test."""
    with patch.dict(FAMILIES):
        family("portal", "A portal.", ClosedFormFile[PortalGeometry], joints="PPPR", links="base X Y Z flange")(Portal)
        file = tmp_path / "portal.yaml"
        file.write_text(FILE)
        yield file


def test_a_robot_of_a_family_loads_and_goes_there_and_back(portal: Path) -> None:
    model = load_model(portal)
    assert isinstance(model, Portal)
    pose = model.forward(model.home)
    np.testing.assert_allclose(pose[:3, 3], [0.5, 0.5, 1.4])
    np.testing.assert_allclose(model.solve(pose, near=model.home), model.home)


def test_a_robot_of_a_family_moves_along_a_line(portal: Path) -> None:
    model = load_model(portal)
    text = "MJ J1=100 J2=100 J3=-200 J4=0\nML X=900 Y=700 Z=1200 F=500\nEND"
    planner = Planner(PlacedRobot.at(model), 0.004)
    motions, failure = dry_run(
        planner, parse_program(text, "p", Names(model.joint_names, linear=model.linear_names)), 60.0
    )
    assert failure is None
    end = motions[-1].motion.q(np.array([motions[-1].motion.duration_s]))
    np.testing.assert_allclose(model.forward(end)[0, :3, 3], [0.9, 0.7, 1.2], atol=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("a1z: 1500", "height: 1500", "unknown key 'height', allowed one of a1z"),
        ("J3: {type: linear, ", "J3: {", "rotary, allowed linear, as in every robot of family portal"),
        ("link: 4", "link: 5", "5, allowed 0 (base) to 4 (flange)"),
        ("family: portal", "family: portable", "'scara', 'six_axis', 'urdf' or 'portal'"),
    ],
)
def test_a_robot_file_of_a_family_is_checked_as_any(portal: Path, old: str, new: str, problem: str) -> None:
    portal.write_text(FILE.replace(old, new))
    with pytest.raises(ConfigError, match=re.escape(problem)):
        load_model(portal)


@pytest.mark.usefixtures("portal")
def test_the_schema_of_robot_files_has_the_family() -> None:
    choices = json.loads(CliRunner().invoke(app, ["schema", "robot"]).output)["oneOf"]
    (choice,) = [each for each in choices if each["title"] == "PortalFile"]
    assert (choice["description"], choice["properties"]["family"]["const"]) == ("A portal.", "portal")


# A shape of zones


@pytest.fixture
def shapes() -> Iterator[None]:
    cube = Measured(("edge",), lambda lengths, pose: Box(np.full(3, lengths[0]), pose))
    with patch.dict(MEASURED, {"cube": cube}):
        yield


@pytest.mark.usefixtures("shapes")
def test_a_zone_of_a_shape_travels_and_knows_who_is_inside() -> None:
    place = PoseSettings((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    space = ZoneSpace(ZoneSettings("middle", (0.4,), place, ("left",), "cube"))
    heard = decode(ZoneGeometry, encode(space.geometry))
    assert heard == space.geometry
    claims = ZoneClaims("left", "boot", 0.25)
    status = ZoneStatus(ZoneState.FREE, None, None, (), heard.version, 0.0)
    claims.heard_state(ManagerState("c", "m", 5, 1, 0.0, "d", {}, {"middle": status}), 0.0)
    claims.heard_geometry(heard)
    for x, inside in ((0.299, True), (0.301, False)):
        assert space.touched_by("left", ball(x)) is inside
        assert claims.touched(ball(x)) == ({"middle"} if inside else set())


# A statement that moves, and one that lasts no time


@dataclass(frozen=True, slots=True)
class Park(Move):
    """`PARK F=...`: a joint move to zero on all joints."""

    joints: tuple[float, ...]
    speed: float

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        speed = percent(named_numbers(words, ("F",))["F"], words[0])
        return cls(line, (0.0,) * len(reading.names.joints), speed)

    def run(self, _walk: Walk) -> JointStep:
        return JointStep(self.line, self.joints, self.speed)

    @property
    def from_anywhere(self) -> bool:
        return True


@dataclass(frozen=True, slots=True)
class Drop(Statement):
    """`DROP name`: this output off."""

    output: str

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        if len(words) != 2:
            raise Mistake(words[0].column, f"{len(words) - 1} words after DROP", "the name of an output")
        return cls(line, words[1].text)

    def run(self, walk: Walk) -> Switch:
        walk.switched += 1
        return Switch(self.line, self.output, False, walk.switched)

    @property
    def switched_outputs(self) -> tuple[str, ...]:
        return (self.output,)


@pytest.fixture
def statements() -> Iterator[None]:
    with patch.dict(STATEMENTS):
        statement("PARK")(Park)
        statement("DROP")(Drop)
        yield


PROGRAM = "MJ J1=2 F=20\ndrop gripper\nMJ J1=6 F=20\nPARK F=50\nEND"


@pytest.mark.usefixtures("statements")
def test_statements_are_read_with_their_mistakes() -> None:
    assert parse_program(PROGRAM, "p", Names(("J1", "J2"))).statements[3] == Park(4, (0.0, 0.0), 0.5)
    with pytest.raises(ProgramError) as caught:
        parse_program("DROP\nPARK F=0\nFLY", "p", Names(("J1",)))
    first, second, third = map(str, caught.value.problems)
    assert first == "1:1: found 0 words after DROP, allowed the name of an output"
    assert second == "2:6: found F=0, allowed 0.01 to 100 percent for PARK"
    assert " DROP, " in third
    assert " PARK, " in third


@pytest.mark.usefixtures("statements")
def test_a_robot_does_what_they_say() -> None:
    world = enabled(PROGRAM, outputs=("glue", "gripper"))
    world.call(Run())
    until(world, ended(world))
    assert [(event.output, event.value) for _, event in world.switched] == [(1, False)]
    assert max(joints[0] for joints in world.played) == pytest.approx(np.radians(6.0))
    np.testing.assert_allclose(world.played[-1], 0.0, atol=1e-9)


@pytest.mark.usefixtures("statements")
def test_a_robot_without_the_output_does_not_begin() -> None:
    world = enabled(PROGRAM)
    call = world.call(Run())
    world.run(0.1)
    assert "line 2 of left.prog switches the output 'gripper'" in world.replies[call].text


# Subcommands of `cell`, with one word and with two


def wear(robot: Annotated[str, typer.Argument(help="Name of the robot.")]) -> None:
    """Print how long the tool of a robot has worked."""
    typer.echo(f"the gripper of {robot} has worked 7.5 s")


@pytest.fixture
def commands() -> Iterator[None]:
    place = Subcommand(__name__, "wear", "cell wear left")
    with patch.dict(COMMANDS_OF_CELL, {"wear": place, "simulate wear": place}):
        yield


@pytest.mark.usefixtures("commands")
@pytest.mark.parametrize("words", [["wear"], ["simulate", "wear"]])
def test_a_subcommand_is_in_the_help_and_runs(words: list[str]) -> None:
    run = CliRunner().invoke
    assert "Print how long the tool of a robot has worked." in run(app, [*words[:-1], "--help"], env=WIDE).output
    assert "Example: cell wear left" in run(app, [*words, "--help"], env=WIDE).output
    assert run(app, [*words, "left"]).output == "the gripper of left has worked 7.5 s\n"


def test_nothing_of_it_is_left() -> None:
    assert "wear" not in CliRunner().invoke(app, ["--help"], env=WIDE).output
    assert Correction in STATES
    assert ToolWear not in STATES
    assert "portal" not in FAMILIES
    assert "PARK" not in STATEMENTS
    assert "cube" not in MEASURED
    assert Keys("two_arms").type_of(KEY) is None
