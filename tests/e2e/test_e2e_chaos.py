"""Random faults on a real cell, judged from outside, and brought back by what its own messages recommend.

ZENCELL_CHAOS_S=1800 ZENCELL_CHAOS_SEED=1 python -m pytest -m soak --timeout 7200 tests/e2e/test_e2e_chaos.py -s
"""

import os
import random
import re
import shlex
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest
from link_proxy import TO_CALLER, TO_TARGET, LinkProxy
from live_cell import LiveCell, Process, wait_until
from outside_observer import OutsideObserver

CYCLE_S = 0.01
BACK_WITHIN_S = 90.0
_ORDER = re.compile(r"`(cell [^`]+)`")


class Chaos:
    """A cell of real processes, the faults that befall it, and an operator who does what he is told."""

    def __init__(self, stack: ExitStack, folder: Path, seed: int) -> None:
        self.rng = random.Random(seed)
        self.live = stack.enter_context(LiveCell(folder, CYCLE_S))
        for robot in self.live.settings.robots.values():
            robot.program.write_text(robot.program.read_text().replace("GOTO again 1\n", "GOTO again 100000\n"))
        settings = self.live.settings
        self.proxies: dict[str, LinkProxy] = {}
        for robot, entry in settings.robots.items():
            for name, endpoint in (
                (f"{robot} manager", settings.manager_endpoint),
                (f"{robot} gateway", settings.gateways[entry.gateway].endpoint),
            ):
                self.proxies[name] = stack.enter_context(LinkProxy(endpoint))
        self.observer = OutsideObserver(self.live.file, CYCLE_S)
        self.running: dict[str, Process] = {}
        self.counts: Counter[str] = Counter()
        self.orders: Counter[str] = Counter()
        for name in self.names:
            self.start(name)
        stack.enter_context(self.observer)

    @property
    def names(self) -> list[str]:
        return ["manager", *self.live.settings.gateways, *self.live.settings.robots]

    def start(self, name: str) -> None:
        """Start a process, unless it runs."""
        if name in self.running and self.running[name].exit_code() is None:
            return
        if name == "manager":
            self.running[name] = self.live.manager()
        elif name in self.live.settings.gateways:
            self.observer.drives_start(name)
            self.running[name] = self.live.gateway(name)
        else:
            ways = ("-e", self.proxies[f"{name} manager"].endpoint, "-e", self.proxies[f"{name} gateway"].endpoint)
            words = (str(self.live.file), name, "--state-dir", str(self.live.state_dir), *ways)
            self.running[name] = self.live.start("robot-agent", *words, "--cfg", "scouting/gossip/enabled:false")

    def signal(self, name: str, number: signal.Signals) -> None:
        if self.running[name].exit_code() is None:
            self.running[name].signal(number)

    def pause(self, low_s: float, high_s: float) -> None:
        threading.Event().wait(self.rng.uniform(low_s, high_s))

    # Faults

    def strike(self) -> str:
        """One fault or two, over when this returns; processes that were killed may be dead."""
        strikes: list[Callable[[], str]] = [self._kill, self._freeze, self._storm, self._link, self._order]
        what = self.rng.choice(strikes)()
        self.counts[what] += 1
        return what

    def _kill(self) -> str:
        names = self.rng.sample(self.names, self.rng.choice([1, 1, 1, 2]))
        for name in names:
            self.signal(name, signal.SIGKILL)
        self.pause(0.1, 3.0)
        return "kill " + " and ".join(sorted(names))

    def _freeze(self) -> str:
        name = self.rng.choice(self.names)
        self.signal(name, signal.SIGSTOP)
        self.pause(0.05, 2.0)
        self.signal(name, signal.SIGCONT)
        return f"freeze {name}"

    def _storm(self) -> str:
        name = self.rng.choice([*self.live.settings.robots, "manager"])
        for _ in range(2):
            self.signal(name, signal.SIGKILL)
            self.running[name].wait(10.0)
            self.start(name)
            self.pause(0.3, 2.0)
        return f"restarts of {name}"

    def _link(self) -> str:
        name = self.rng.choice(sorted(self.proxies))
        proxy = self.proxies[name]
        way = self.rng.choice([TO_TARGET, TO_CALLER])
        what = self.rng.choice(["cut", "hold", "delay", "delay after end"])
        match what:
            case "cut":
                proxy.cut()
            case "hold":
                proxy.hold(way)
            case "delay":
                proxy.delay(way, self.rng.uniform(0.1, 3.0))
            case _:
                proxy.delay(way, self.rng.uniform(0.3, 2.0), keep_after_end=True)
                self.signal(name.split()[0], signal.SIGKILL)
                self.running[name.split()[0]].wait(10.0)
                self.start(name.split()[0])
        self.pause(0.2, 4.0)
        proxy.mend()
        return f"{what} {name}"

    def _order(self) -> str:
        robot = self.rng.choice(sorted(self.live.settings.robots))
        words: tuple[str, ...] = self.rng.choice(
            [
                ("halt", robot),
                ("override", robot, "--", str(self.rng.choice([-50, 0, 20, 100]))),
                ("estop", "--reason", "chaos"),
                ("disable", robot),
                ("reset",),
                ("step", robot),
            ]
        )
        self.live.order(*words, timeout_s=60.0)
        self.pause(0.0, 2.0)
        return f"cell {words[0]}"

    # The operator

    def bring_back(self) -> None:
        """Until both programs run: start what has ended, do what the messages recommend, then what is due daily."""
        deadline = time.monotonic() + BACK_WITHIN_S
        tried: list[str] = []
        while not self._both_run():
            if time.monotonic() > deadline:
                states = {robot: self.observer.fresh(robot) for robot in self.live.settings.robots}
                raise AssertionError(f"not back within {BACK_WITHIN_S:g} s; tried {tried}; robots {states}")
            for name in self.names:
                self.start(name)
            for order in self._orders()[:1]:
                tried.append(order)
                self.orders[" ".join(order.split()[:2])] += 1
                done = self.live.order(*shlex.split(order)[1:], timeout_s=60.0)
                tried.append(f"-> {done.exit_code()}: {done.output.strip()[:200]}")
            self.pause(0.2, 0.4)

    def _both_run(self) -> bool:
        states = [self.observer.fresh(robot) for robot in self.live.settings.robots]
        moving = [s is not None and s["mode"] == "running" and not _ORDER.search(s["waiting_for"]) for s in states]
        slow = [s is not None and s["pace"]["override"] != 1.0 for s in states]
        return all(moving) and not any(slow)

    def _orders(self) -> list[str]:
        """What to do next: first what the messages that stand now recommend, then an operator's day."""
        texts: list[str] = []
        at, manager = self.observer.manager
        if time.monotonic() - at < 1.0:
            texts += [zone["reason"] for zone in manager["zones"].values()]
            texts += manager["refused"].values()
            texts += ["`cell reset`"] if manager.get("estops") or manager.get("estop") else []
        orders, daily = [], []
        for robot in sorted(self.live.settings.robots):
            state = self.observer.fresh(robot)
            if state is None:
                continue
            texts += [*state["alarms"], state["waiting_for"], state["program"]["error"]]
            usual = {
                "disabled": f"cell enable {robot}",
                "ready": f"cell run {robot}",
                "halted": f"cell continue {robot}",
            }
            usual |= {"fault": f"cell reset {robot}", "off_path": f"cell return {robot}"}
            if state["mode"] in usual:
                daily.append(usual[state["mode"]])
            if state["pace"]["override"] != 1.0:
                orders.append(f"cell override {robot} 100")
        for text in texts:
            orders += [order for order in _ORDER.findall(text) if "ROBOT" not in order]
        if self.observer.somebody_inside:  # an operator who looks, as the words ask him to
            orders = [order for order in orders if not order.startswith("cell zone clear")]
        chosen = [*orders, *daily]
        # What is recommended in general and does not help must not keep the operator from the rest.
        self.rng.shuffle(chosen)
        return chosen

    # The end

    def tracebacks(self) -> list[str]:
        """Outputs of all processes that were started which hold a traceback."""
        return [f.name for f in sorted(self.live.folder.glob("*.out")) if "Traceback" in f.read_text(errors="replace")]


@pytest.mark.soak
def test_soak_random_faults_break_nothing_and_the_messages_tell_how_to_go_on(tmp_path: Path) -> None:
    seconds = float(os.environ.get("ZENCELL_CHAOS_S", "600"))
    seed = int(os.environ.get("ZENCELL_CHAOS_SEED", "1"))
    with ExitStack() as stack:
        chaos = Chaos(stack, tmp_path, seed)
        wait_until(lambda: len(chaos.observer.states) == len(chaos.live.settings.robots), 60.0, "both agents")
        chaos.bring_back()
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            chaos.pause(1.5, 6.0)
            what = chaos.strike()
            chaos.bring_back()
            print(f"{seconds - (end - time.monotonic()):7.1f} s  {what}", flush=True)
            assert chaos.observer.breaches == [], what
        print("faults:", dict(chaos.counts))
        print("orders:", dict(chaos.orders))
        print("seen:", dict(chaos.observer.counts), "worst:", chaos.observer.worst)
        assert chaos.tracebacks() == []
