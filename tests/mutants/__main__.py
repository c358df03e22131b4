"""`make mutants`: plant each fault, search it by seeds, print by what it was found and after how many runs.

    python -m tests.mutants                       all, two at a time
    python -m tests.mutants NAME [NAME ...]       these
    python -m tests.mutants --list

The exit code is 1 when a fault is not found that is not known to be harmless, or one is found that is.
"""

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from tests.mutants.catalog import GROUPS, MUTANTS
from tests.mutants.mutant import Bench, Mutant, check_applies, plant

_HANGS_S = 1800
"""A search that takes more processor time hangs, which is a way to be found."""
_MOST_BYTES = 6 * 2**30
"""Of memory: one that hangs may take all there is."""
_NO_MEMORY = ("MemoryError", "Cannot allocate memory")


@dataclass(frozen=True, slots=True)
class Found:
    """How the search of one tree ended. `by` is empty where every run was in order, `runs` is 0 where none ended.

    A tree whose cell does not start is not a found fault: it may be planted badly. `trouble` says so.
    """

    by: str
    runs: int
    at_s: float
    took_s: float
    trouble: str = ""


def search(mutant: Mutant | None, bench: Bench) -> Found:
    """Search the tree with this fault, in a process of its own; the first broken invariant ends it."""
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="mutant-") as folder:
        tree, report = Path(folder) / "tree", Path(folder) / "report.json"
        plant(mutant, tree)
        runs = bench.command(harmless=mutant is not None and bool(mutant.harmless))
        command = [sys.executable, *runs, "--stop-at-first", "--json", str(report)]
        environment = os.environ | {"PYTHONPATH": str(tree), "OPENBLAS_NUM_THREADS": "1"}
        limited = ["prlimit", f"--cpu={_HANGS_S}", f"--as={_MOST_BYTES}", *command]
        done = subprocess.run(limited, cwd=tree, env=environment, capture_output=True, text=True, check=False)
        took_s = time.monotonic() - began
        if done.returncode in (-signal.SIGXCPU, -signal.SIGKILL):
            return Found("the run does not end", 0, 0.0, took_s)
        if not report.exists():
            last = (done.stderr.strip().splitlines() or ["nothing was said"])[-1]
            if any(each in last for each in _NO_MEMORY):
                return Found(f"the run takes all memory: {last}", 0, 0.0, took_s)
            return Found("", 0, 0.0, took_s, f"the cell does not start: {last}")
        told = json.loads(report.read_text())
    if not told["broken"]:
        return Found("", told["seeds"], 0.0, took_s)
    first = told["broken"][0]
    return Found(first["invariant"], told["seeds"], first["at_s"], took_s)


def judge(mutant: Mutant, found: Found) -> bool:
    """Whether the outcome is the one that the catalog says."""
    return not found.trouble and bool(found.by) != bool(mutant.harmless)


def line(mutant: Mutant, found: Found) -> str:
    """One line of the list."""
    if found.by:
        when = f" in run {found.runs} after {found.at_s:.1f} s" if found.runs else ""
        how = f"found{when} by: {found.by}"
    else:
        how = found.trouble or f"NOT found in {found.runs} runs"
    known = f" (harmless: {mutant.harmless})" if mutant.harmless else ""
    return f"{mutant.name:28s} {how}{known}  [{found.took_s:.0f} s]  {mutant.says}"


def run_all(mutants: list[Mutant], jobs: int) -> bool:
    """Print each outcome as it comes, also of trees without any fault; whether all are as they should be."""
    good = found_count = 0
    began = time.monotonic()
    with ThreadPoolExecutor(jobs) as pool:
        clean = {pool.submit(search, None, bench): bench for bench in dict.fromkeys(each.bench for each in mutants)}
        planted = {pool.submit(search, mutant, mutant.bench): mutant for mutant in mutants}
        for ended in as_completed([*clean, *planted]):
            found = ended.result()
            if ended in planted:
                good += judge(planted[ended], found)
                found_count += bool(found.by)
                print(line(planted[ended], found), flush=True)
                continue
            name = f"(nothing, {clean[ended].name.lower()})"
            how = found.by or found.trouble or "in order"
            print(f"{name:28s} {how}, {found.runs} runs  [{found.took_s:.0f} s]", flush=True)
            if how != "in order":
                print("the tree breaks an invariant without any planted fault: mend that first")
                pool.shutdown(cancel_futures=True)
                return False
    harmless = sum(bool(mutant.harmless) for mutant in mutants)
    took = (time.monotonic() - began) / 60
    print(f"{found_count} of {len(mutants)} planted faults found, {harmless} known to be harmless, in {took:.1f} min")
    return good == len(mutants)


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description="plant faults and look for them")
    parser.add_argument("names", nargs="*", help="only these (see --list), or a group: " + ", ".join(GROUPS))
    parser.add_argument("--list", action="store_true", help="print the catalog")
    parser.add_argument("--jobs", type=int, default=max(1, os.cpu_count() or 1), help="searches at a time")
    options = parser.parse_args()
    by_name = {mutant.name: mutant for mutant in MUTANTS}
    unknown = [name for name in options.names if name not in by_name and name not in GROUPS]
    if unknown:
        parser.error(f"no planted fault is named {unknown[0]!r}; see --list")
    chosen = [m for m in MUTANTS if not options.names or m.name in options.names]
    chosen += [m for name, group in GROUPS.items() if name in options.names for m in group if m not in chosen]
    for mutant in chosen:
        check_applies(mutant)
        if options.list:
            print(f"{mutant.name:28s} {mutant.says}")
    if options.list:
        return 0
    return 0 if run_all(chosen, options.jobs) else 1


if __name__ == "__main__":
    sys.exit(main())
