"""Search for what is broken: many seeds of generated cells under all faults.

python -m tests.sim.search --seeds 0:2000 --jobs 2
python -m tests.sim.search --seeds 0:2000 --rooms
python -m tests.sim.search --replay 17
python -m tests.sim.search --replay 17 --shrink
"""

import argparse
import gc
import json
import logging
import multiprocessing
import os
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from tests.sim.cells import is_room
from tests.sim.coverage import table, unseen
from tests.sim.judge import ALL
from tests.sim.run import SEEDS_PER_CELL, Crashed, Outcome, run_seed
from tests.sim.shrink import shrink

_ENOUGH_TO_HAVE_SEEN_ALL = 2000
"""Contended seeds."""
_COLUMNS = ("fault", "moment", "order", "mode", "program", "zone", "playout", "refusal", "event", "killed", "frozen")


@dataclass(frozen=True, slots=True)
class Found:
    """What is left of a run for the totals."""

    seed: int
    invariant: str
    who: str
    at_s: float
    what: str
    duration_s: float
    robots: int
    contended: bool
    counts: Counter[str]
    processor_s: float

    @property
    def ok(self) -> bool:
        return not self.invariant


def found(outcome: Outcome, processor_s: float) -> Found:
    broken = outcome.broken
    seen = ("", "", 0.0, "") if broken is None else (broken.invariant, broken.who, broken.at_s, broken.what)
    counts = outcome.coverage.counts
    return Found(outcome.seed, *seen, outcome.duration_s, len(outcome.families), outcome.contended, counts, processor_s)


def _search_one(job: tuple[int, float, tuple[str, ...] | None]) -> Found:
    seed, seconds, only = job
    logging.disable(logging.CRITICAL)
    gc.collect()
    gc.disable()  # a run keeps what it makes: looking for garbage in it takes a seventh of its time
    before = time.process_time()
    try:
        outcome = run_seed(seed, seconds, only)
    except Exception as error:  # before the run begins: the other seeds go on
        told = Crashed(error)
        seen = told.invariant, told.who, told.at_s, told.what
        return Found(seed, *seen, 0.0, 0, False, Counter(), time.process_time() - before)
    return found(outcome, time.process_time() - before)


def _all(seeds: Sequence[int], seconds: float, only: tuple[str, ...] | None, jobs: int) -> Iterator[Found]:
    work = [(seed, seconds, only) for seed in seeds]
    if jobs == 1:
        for job in work:  # not by `map`, which a StopIteration out of a run would end in silence
            yield _search_one(job)
        return
    with multiprocessing.get_context("fork").Pool(jobs, maxtasksperchild=50) as pool:
        yield from pool.imap_unordered(_search_one, work, chunksize=SEEDS_PER_CELL)


def replay_command(seed: int, seconds: float) -> str:
    longer = "" if seconds == _SECONDS else f" --seconds {seconds:g}"
    return f"python -m tests.sim.search --replay {seed}{longer}"


_SECONDS = 30.0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description="search generated cells under all faults for broken invariants")
    parser.add_argument("--seeds", metavar="A:B", help="from A up to before B")
    parser.add_argument("--rooms", action="store_true", help="of these seeds those whose cells have no zones")
    parser.add_argument("--seconds", type=float, default=_SECONDS, help="longest time of a run but the way back")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what was found there")
    parser.add_argument(
        "--only", metavar="NAMES", help=f"of the invariants, by comma: {', '.join(k.name for k in ALL)}"
    )
    parser.add_argument("--stop-at-first", action="store_true", help="end at the first seed that fails")
    parser.add_argument("--replay", type=int, metavar="SEED", help="run one seed and tell what happened")
    parser.add_argument("--shrink", action="store_true", help="with --replay: leave out what is not needed to fail")
    return parser


def main(arguments: list[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    only = None if options.only is None else tuple(name.strip() for name in options.only.split(","))
    if options.replay is not None:
        return _replay(options.replay, options.seconds, only, options.shrink)
    if options.seeds is None:
        _parser().error("--seeds A:B or --replay SEED is needed")
    first, _, last = options.seeds.partition(":")
    seeds = [seed for seed in range(int(first), int(last)) if is_room(seed // SEEDS_PER_CELL) or not options.rooms]
    results: list[Found] = []
    began = time.monotonic()
    for each in _all(seeds, options.seconds, only, options.jobs):
        results.append(each)
        if not each.ok:
            print(
                f"seed {each.seed}: {each.invariant}, at {each.at_s:.3f} s, {each.who}: {each.what}\n"
                f"    {replay_command(each.seed, options.seconds)}",
                flush=True,
            )
            if options.stop_at_first:
                break
    return _totals(results, options, time.monotonic() - began)


def _totals(results: list[Found], options: argparse.Namespace, took_s: float) -> int:
    counts: Counter[str] = Counter()
    for each in results:
        counts.update(each.counts)
    failed = [each for each in results if not each.ok]
    alone = sorted(each.seed for each in results if not each.contended)
    contended = len(results) - len(alone)
    cell_s = sum(each.duration_s for each in results)
    kills = sum(n for name, n in counts.items() if name.startswith("killed "))
    freezes = sum(n for name, n in counts.items() if name.startswith("frozen "))
    orders = sum(n for name, n in counts.items() if name.startswith("order "))
    processor_s = sum(each.processor_s for each in results) / max(1, len(results))
    print(
        f"{len(results)} seeds, {len(failed)} failed, {contended} contended; "
        f"{cell_s:.0f} s of cell time in {took_s:.0f} s, {processor_s:.1f} s of processor time each"
    )
    print(
        f"{counts['grants']} grants, {kills} kills, {freezes} freezes, {counts['fault partition']} partitions, "
        f"{counts['fault cut']} cuts, {counts['fault estop']} emergency stops, {orders} orders at bad moments"
    )
    for line in table(counts, _COLUMNS):
        print(line)
    never = unseen(counts)
    if alone:
        print(f"seeds without contention, which do not count: {', '.join(map(str, alone))}")
    if never:
        print(f"never seen: {', '.join(never)}")
        counts_from = f"a failure from {_ENOUGH_TO_HAVE_SEEN_ALL} contended seeds on"
        print(f"what is never seen is {counts_from}; {contended} of these {len(results)} seeds are contended")
    blind = bool(never) and contended >= _ENOUGH_TO_HAVE_SEEN_ALL
    if options.json is not None:
        _write(options.json, results, counts, never)
    return 1 if failed or blind else 0


def _write(file: Path, results: list[Found], counts: Counter[str], never: list[str]) -> None:
    broken = [
        {"seed": each.seed, "invariant": each.invariant, "at_s": each.at_s, "who": each.who, "what": each.what}
        for each in results
        if not each.ok
    ]
    told = {
        "seeds": len(results),
        "contended": sum(each.contended for each in results),
        "cell_s": sum(each.duration_s for each in results),
        "processor_s": sum(each.processor_s for each in results),
        "broken": broken,
        "seen": dict(sorted(counts.items())),
        "never_seen": never,
    }
    file.write_text(json.dumps(told, indent=1) + "\n")


def _replay(seed: int, seconds: float, only: tuple[str, ...] | None, shrinks: bool) -> int:
    logging.disable(logging.CRITICAL)
    try:
        outcome = run_seed(seed, seconds, only)
    except Exception as error:  # before the run begins: nothing is known but this
        print(f"seed {seed}: {Crashed(error)}")
        return 1
    if outcome.broken is not None and shrinks:
        outcome = shrink(outcome, seconds, only)
    for event in outcome.coverage.events:
        print(event)
    print(f"seed {seed}: {', '.join(outcome.families)}, {outcome.duration_s:.1f} s; its plan, and when it struck:")
    struck = {id(item): at for at, item in outcome.struck}
    for item in outcome.plan:
        at = struck.get(id(item))
        print(f"  {'       -' if at is None else f'{at:8.3f}'}  {item}")
    if outcome.broken is None:
        print("nothing is broken")
        return 0
    print(outcome.broken)
    return 1


if __name__ == "__main__":
    sys.exit(main())
