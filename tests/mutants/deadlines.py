"""Faults of what drawn cells hardly ever come to: docs/architecture.md, sections 4.1, 5.1 and 6."""

from tests.mutants.mutant import Bench, Edit, Mutant

BUS_WATCH = "drive_gateway/gateway/cycle/bus_watch.py"
SETUP_TURN = "drive_gateway/gateway/orders/setup_turn.py"
SETUP_AXIS = "drive_gateway/gateway/setup/setup_axis.py"

DEADLINES = (
    Mutant(
        "bus-failure-is-no-fault",
        "a bus that fails is told, and its robots are in no fault",
        (
            Edit(
                BUS_WATCH,
                "        running = [robot for robot in self._robots if robot.group.operational]\n",
                "        running = list[Robot]()\n",
            ),
        ),
        bench=Bench.SITUATION,
    ),
    Mutant(
        "second-master-is-let-be",
        "frames that only the gateway sends come from somebody else, and robots go on",
        (Edit(BUS_WATCH, "        for group in moving:\n            group.fault(trouble, now)\n", ""),),
        bench=Bench.SCENE,
    ),
    Mutant(
        "io-node-not-missed",
        "an I/O node that falls silent stops no robot that uses it",
        (
            Edit(
                "drive_gateway/gateway/cycle/io_watch.py",
                "            for group in users:\n                group.fault(trouble, now)\n",
                "            self._log.warn(trouble.code, trouble.text, trouble.remedy)\n",
            ),
        ),
        bench=Bench.SITUATION,
    ),
    Mutant(
        "set-up-without-a-hand",
        "a motion of set-up goes on although its operator has let go",
        (
            Edit(
                "drive_gateway/gateway/setup/setup_motion.py",
                "        if now - self._held_at > HOLD_S:\n",
                "        if False:\n",
            ),
        ),
        bench=Bench.SITUATION,
    ),
    Mutant(
        "set-up-without-manager",
        "a motion of set-up goes on although no manager keeps the other robots still any more",
        (
            Edit(
                SETUP_TURN,
                "            elif why_not:\n                robot.group.setup.motion.halt(why_not, now)\n",
                "",
            ),
        ),
        bench=Bench.SITUATION,
    ),
    Mutant(
        "set-up-beside-others",
        "a motion of set-up begins although others may move",
        (
            Edit(
                SETUP_TURN,
                'if not (state.setup.free and answered) else ""',
                'if not answered else ""',
            ),
        ),
        bench=Bench.SITUATION,
    ),
    Mutant(
        "a-halt-is-all",
        "a drive that does not halt in set-up gets no quick stop",
        (
            Edit(
                SETUP_AXIS,
                '                self.stop(f"{self.node.label} did not halt, it got a quick stop", now)\n',
                "                pass\n",
            ),
        ),
        bench=Bench.SITUATION,
    ),
    Mutant(
        "left-switched-on",
        "a drive that stays switched on after set-up is not told of",
        (
            Edit(
                SETUP_AXIS,
                '        self.trouble = Trouble("not_off", self.problem, HARD_WIRED, self.node.axis.node_id)\n',
                "",
            ),
        ),
        bench=Bench.SITUATION,
    ),
    Mutant(
        "runs-on-untold",
        "an axis that was told to stop and runs on is not told of, nor stopped through its node",
        (
            Edit(
                "drive_gateway/gateway/watch/stop_watch.py",
                "            if drive not in self._told and drive.rest.moved_at > since + drive.rest.stop_s:\n",
                "            if drive not in self._told and drive.rest.moved_at > since + 1e9:\n",
            ),
        ),
        bench=Bench.SITUATION,
    ),
    Mutant(
        "slips-untold",
        "an axis without torque slips, and nobody is told",
        (
            Edit(
                "drive_gateway/gateway/watch/brake_watch.py",
                "            if far:\n",
                "            if far and drive.counts is None:\n",
            ),
        ),
        bench=Bench.SITUATION,
    ),
    Mutant(
        "drives-do-not-watch",
        "drives and I/O nodes are not told to miss their gateway",
        (
            Edit(
                "drive_gateway/cia402/preparation.py",
                "    consumer = settings.node_id << 16 | _milliseconds(settings.heartbeat_timeout_s)\n",
                "    consumer = 0\n",
            ),
        ),
        bench=Bench.SITUATION,
    ),
    Mutant(
        "old-measurements-followed",
        "a robot goes on following what nobody measures any more",
        (
            Edit(
                "robot_agent/trajectory/sources/target.py",
                "    if age_s > fresh_s:\n",
                "    if age_s > max(fresh_s, 1e9):\n",
            ),
        ),
        bench=Bench.SITUATION,
    ),
    Mutant(
        "switched-under-a-program",
        "an operator's order switches an output while a program runs",
        (
            Edit(
                "drive_gateway/gateway/robots/hand_switch.py",
                "        if group.playout.programmed:\n",
                "        if False:\n",
            ),
        ),
        bench=Bench.SITUATION,
    ),
    Mutant(
        "nothing-in-reserve",
        "blocks have hardly more than what is played before the next one, so each lost one slows the robot",
        (
            Edit(
                "robot_agent/agent/blocks/executive.py",
                "        self.supply = Supply(planner, times.nominal_s)\n",
                "        self.supply = Supply(planner, 0.05)\n",
            ),
        ),
        bench=Bench.SCENE,
    ),
    Mutant(
        "wishes-in-parts",
        "of zones that are needed together a robot gets the ones that are free",
        (
            Edit(
                "cell/manager/zone_turns.py",
                "            free = all(zones[name].open_to(wish.robot, sights[name][wish.robot]) for name in wish.zones)\n",
                "            open_ = [name for name in wish.zones if zones[name].open_to(wish.robot, sights[name][wish.robot])]\n"
                "            free = bool(open_)\n",
            ),
            Edit(
                "cell/manager/zone_turns.py",
                "            for name in wish.zones:\n                zones[name].grant(",
                "            for name in open_:\n                zones[name].grant(",
            ),
        ),
        bench=Bench.SCENE,
    ),
    Mutant(
        "last-comes-first",
        "of those who wait for a zone the one that came last is next",
        (
            Edit(
                "cell/manager/zone_turns.py",
                "key=lambda wish: (-wish.rank, wish.came))",
                "key=lambda wish: (-wish.rank, -wish.came[0]))",
            ),
        ),
    ),
)
