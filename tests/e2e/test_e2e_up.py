"""`cell up`: a whole cell from one command, and its end."""

import re

from live_cell import LiveCell


def test_both_programs_run_to_their_end(live: LiveCell) -> None:
    up = live.up("--until-done")
    assert up.wait(90.0) == 0, up.output
    assert re.search(r"all robots enabled after \d+\.\d s", up.output)
    for robot in live.settings.robots:
        assert re.search(rf"robot {robot} waited \d+\.\d s for zone", up.output)
