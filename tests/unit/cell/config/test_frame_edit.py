"""A frame's place written into a cell file: nothing else changes, and the file is always whole."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.config import load_cell
from cell.config.cell_edit import Changes, NotWritten, changed
from cell.config.frame_edit import write_frame
from cell.config.settings import FrameSettings, PoseSettings
from cell.geometry import from_xyz_abc, taught_frame
from tests.unit.config_world import CELL, TWO_ARMS, Copy
from tests.unit.repository import ROOT

FRAMES = """\
frames:   # where things stand
  table:  # bolted down
    pose:
      C: 90  # turned
      # the foot of the left leg
      X: 900
      Y: 0x10
      Z: 700.5   # mm
      A: 0
      B: -0.0
  nest: {parent: table, pose: {X: 1, Y: 2, Z: 3, A: 0, B: 0, C: 0}}  # a comment with C: 90
  rack: {points: [[0, 0, 0], [100, 0, 0], [0, 100, 0]]} # three
  post:
    points:
      - [0, 0, 0]      # mark
      - [100, 0, 0]
      - [0, 100, 0]
"""
POINTS = ((0.5, 0.0, 0.0), (0.5, 0.3, 0.0), (0.2, 0.0, 0.0))


def pose(x: float = 0.0, y: float = 0.0, z: float = 0.0, c_deg: float = 0.0) -> PoseSettings:
    return PoseSettings.of(from_xyz_abc(np.array([x, y, z, 0.0, 0.0, np.radians(c_deg)])))


@pytest.fixture
def copy(tmp_path: Path) -> Copy:
    return Copy(tmp_path).add(CELL, FRAMES)


def running(copy: Copy) -> dict[str, FrameSettings]:
    return load_cell(copy.cell).frames


def test_only_the_numbers_of_the_pose_change(copy: Copy) -> None:
    before = copy.cell.read_text()
    found = write_frame(copy.cell, "table", pose(0.9012345678, -0.02, 0.7, 45.0), running(copy))
    wanted = before.replace("C: 90  # turned", "C: 45  # turned").replace("X: 900", "X: 901.2346")
    wanted = wanted.replace("0x10", "-20").replace("700.5  ", "700  ").replace("-0.0", "0")
    assert copy.cell.read_text() == wanted
    assert found == running(copy)
    assert found["table"].pose.position_m == (0.9012346, -0.02, 0.7)


def test_the_frames_that_lie_in_it_come_along(copy: Copy) -> None:
    found = write_frame(copy.cell, "table", pose(1.0), running(copy))
    np.testing.assert_allclose(found["nest"].pose.position_m, (1.001, 0.002, 0.003))


def test_points_are_written_where_the_file_has_points(copy: Copy) -> None:
    before = copy.cell.read_text()
    found = write_frame(copy.cell, "rack", POINTS, running(copy))
    assert "rack: {points: [[500, 0, 0], [500, 300, 0], [200, 0, 0]]} # three" in copy.cell.read_text()
    np.testing.assert_allclose(found["rack"].pose.matrix(), taught_frame(np.array(POINTS)), atol=1e-12)
    write_frame(copy.cell, "post", POINTS, running(copy))
    assert "- [500, 0, 0]      # mark\n      - [500, 300, 0]\n" in copy.cell.read_text()
    assert len(copy.cell.read_text().splitlines()) == len(before.splitlines())


def test_another_number_of_points_is_written_where_no_comment_is_lost(copy: Copy) -> None:
    found = write_frame(copy.cell, "rack", (*POINTS, (0.0, 0.0, 0.009)), running(copy))
    assert "[200, 0, 0], [0, 0, 9]]} # three" in copy.cell.read_text()
    assert found["rack"].pose.position_m == (0.0, 0.0, 0.009)
    with pytest.raises(NotWritten, match="teach as many as it has"):
        write_frame(copy.cell, "post", (*POINTS, (0.0, 0.0, 0.0)), running(copy))


def test_what_is_taught_in_world_becomes_the_pose_in_the_parent_where_the_file_has_a_pose(copy: Copy) -> None:
    found = write_frame(copy.cell, "nest", POINTS, running(copy))
    np.testing.assert_allclose(found["nest"].pose.matrix(), taught_frame(np.array(POINTS)), atol=1e-6)
    assert found["nest"].parent == "table"


def test_a_file_in_metres_and_radians_with_a_byte_order_mark_and_other_line_ends_stays_so(tmp_path: Path) -> None:
    file = tmp_path / "cell.yaml"
    text = TWO_ARMS.read_text().replace("length: mm, angle: deg", "length: m, angle: rad")
    text += "frames: {table: {pose: {X: 1.5, Y: 0, Z: 0, A: 0, B: 0, C: 0}}}  # é\n"
    before = b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode()
    file.write_bytes(before)
    write_frame(file, "table", pose(0.9, c_deg=90.0), {"table": FrameSettings("table", None, pose(1.5))})
    assert file.read_bytes() == before.replace(b"X: 1.5", b"X: 0.9").replace(b"C: 0}}}", b"C: 1.57079633}}}")


def test_a_file_that_somebody_has_changed_since_is_left_to_him(copy: Copy) -> None:
    frames = running(copy)
    copy.change(CELL, "X: 900", "X: 901")
    before = copy.cell.read_text()
    with pytest.raises(NotWritten, match="gives nest, table otherwise than the cell runs with"):
        write_frame(copy.cell, "rack", POINTS, frames)
    assert copy.cell.read_text() == before


@pytest.mark.parametrize(
    ("frame", "place", "says"),
    [
        ("rack", pose(), "frame rack is given by points: teach it again"),
        ("rack", ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (2.0, 0.0, 0.0)), "the points lie in one line"),
        ("table", ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0)), "the points lie in one line"),
    ],
)
def test_what_cannot_be_written_leaves_the_file_as_it_is(
    copy: Copy, frame: str, place: PoseSettings, says: str
) -> None:
    before = copy.cell.read_bytes()
    with pytest.raises(NotWritten, match=says):
        write_frame(copy.cell, frame, place, running(copy))
    assert copy.cell.read_bytes() == before


@pytest.mark.parametrize("step", ["os.fsync", "os.replace", "shutil.copymode"])
def test_a_disk_that_fails_at_any_step_leaves_the_old_file_and_nothing_beside_it(copy: Copy, step: str) -> None:
    before, beside, frames = copy.cell.read_bytes(), sorted(copy.cell.parent.iterdir()), running(copy)
    with patch(step, side_effect=OSError(28, "No space left on device")), pytest.raises(NotWritten, match="No space"):
        write_frame(copy.cell, "table", pose(), frames)
    assert copy.cell.read_bytes() == before
    assert sorted(copy.cell.parent.iterdir()) == beside


def test_mode_and_link_of_the_file_stay(copy: Copy) -> None:
    link = copy.cell.with_name("link.yaml")
    link.symlink_to(copy.cell)
    copy.cell.chmod(0o640)
    write_frame(link, "table", pose(0.25), running(copy))
    assert link.is_symlink()
    assert copy.cell.stat().st_mode & 0o777 == 0o640
    assert running(copy)["table"].pose.position_m == (0.25, 0.0, 0.0)


_WRITER = """
import itertools, sys
from pathlib import Path
from cell.config import load_cell
from cell.config.frame_edit import write_frame
from cell.config.settings import PoseSettings
file = Path(sys.argv[1])
frames = load_cell(file).frames
for x in itertools.cycle((0.1, 0.2)):
    frames = write_frame(file, "table", PoseSettings((x, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)), frames)
    print(x, flush=True)
"""


def test_a_writer_that_is_killed_leaves_the_old_file_or_the_new_one(copy: Copy) -> None:
    write_frame(copy.cell, "table", pose(0.1), running(copy))
    one = copy.cell.read_bytes()
    write_frame(copy.cell, "table", pose(0.2), running(copy))
    other = copy.cell.read_bytes()
    with subprocess.Popen(
        [sys.executable, "-c", _WRITER, str(copy.cell)], stdout=subprocess.PIPE, cwd=ROOT, env=os.environ
    ) as writer:
        assert writer.stdout is not None
        watchdog = threading.Timer(30.0, writer.kill)
        watchdog.start()
        for _ in range(3):
            assert writer.stdout.readline()
            assert copy.cell.read_bytes() in (one, other)
        writer.send_signal(signal.SIGKILL)
        watchdog.cancel()
    assert copy.cell.read_bytes() in (one, other)


NUMBERS = st.floats(-1e6, 1e6).map(lambda value: f"{value:.4f}")
SPACES = st.sampled_from(["", " ", "  # C: 3", " # [1, 2]"])


@settings(max_examples=30)
@given(st.lists(st.tuples(NUMBERS, SPACES), min_size=1, max_size=5), st.integers(0, 4), NUMBERS)
def test_whatever_stands_around_a_number_stays(lines: list[tuple[str, str]], which: int, new: str) -> None:
    which %= len(lines)
    rows = [f"  k{k}: {number}{after}\n" for k, (number, after) in enumerate(lines)]
    after = lines[which][1]
    wanted = [*rows[:which], f"  k{which}: {new}{after}\n", *rows[which + 1 :]]
    assert changed("a:\n" + "".join(rows), Changes({("a", f"k{which}"): new})) == "a:\n" + "".join(wanted)
