"""The command of what searches runs by seeds; what it writes is as `tests.sim.search` has it."""

import argparse
import json
from collections.abc import Callable
from pathlib import Path


def search(description: str, broken: Callable[[int], tuple[str, float]]) -> int:
    """Look at the seeds that are asked for; `broken` says what is wrong in a run, empty for nothing, and when.

    Returns the exit code.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--seeds", metavar="A:B", required=True, help="from A up to before B")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what was found there")
    parser.add_argument("--stop-at-first", action="store_true", help="end at the first run that is broken")
    options = parser.parse_args()
    first, _, last = options.seeds.partition(":")
    found: list[dict[str, object]] = []
    runs = 0
    for seed in range(int(first), int(last)):
        runs += 1
        what, at = broken(seed)
        if what:
            print(f"run {seed}: {what}, at {at:g}", flush=True)
            found.append({"seed": seed, "invariant": what, "at_s": at})
        if found and options.stop_at_first:
            break
    print(f"{runs} runs, {len(found)} broken")
    if options.json is not None:
        options.json.write_text(json.dumps({"seeds": runs, "broken": found}) + "\n")
    return 1 if found else 0
