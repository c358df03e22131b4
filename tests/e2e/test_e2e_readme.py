"""The subscriber in the README works as it is printed there."""

import re
import subprocess
import sys
from pathlib import Path

from live_cell import LiveCell, wait_until

README = Path(__file__).parents[2] / "README.md"


def test_the_subscriber_prints_both_robots(live: LiveCell, tmp_path: Path) -> None:
    program = next(
        block for block in re.findall(r"```python\n(.*?)```", README.read_text(), re.S) if "zenoh.open" in block
    )
    script = tmp_path / "watch.py"
    endpoint = live.settings.manager_endpoint
    script.write_text(program.replace("tcp/127.0.0.1:7450", endpoint))
    assert endpoint in script.read_text(), "the README's subscriber connects to the example cell's rendezvous"
    live.up().wait_for_output("all robots enabled", 60.0)
    printed = tmp_path / "printed"
    with (
        printed.open("wb") as out,
        subprocess.Popen([sys.executable, "-u", str(script)], stdout=out, stderr=subprocess.STDOUT) as watcher,
    ):
        try:
            for robot in live.settings.robots:
                wait_until(lambda name=robot: name in printed.read_text(), 20.0, f"a line about {robot}")
        finally:
            watcher.kill()
