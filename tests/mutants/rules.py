"""One fault for each rule of docs/architecture.md: 4.1 (zones), 5.1 (how blocks join), 6 (deadlines)."""

from tests.mutants.findings import CLAIMS, CORE, ZONES
from tests.mutants.mutant import Bench, Edit, Mutant

PLAYOUT = "drive_gateway/gateway/playout/playout.py"
JOINING = "drive_gateway/gateway/playout/joining.py"
GROUP = "drive_gateway/gateway/robots/group.py"
BUS_WATCH = "drive_gateway/gateway/cycle/bus_watch.py"
SETUP_TURN = "drive_gateway/gateway/orders/setup_turn.py"
SETUP_AXIS = "drive_gateway/gateway/setup/setup_axis.py"

RULES = (
    # 4.1: the rule that is lease, heartbeat and fence in one
    Mutant(
        "token-not-compared",
        "an agent enters under a grant whose token it did not take up",
        (
            Edit(
                CLAIMS,
                "            and status.token is not None\n            and status.token == self.holds.get(zone)\n",
                "",
            ),
        ),
    ),
    Mutant(
        "let-go-inside",
        "an agent lets a zone go while its body is inside",
        (
            Edit(
                CLAIMS,
                "            elif name not in inside and (token is None or name not in needed):",
                "            elif token is None or name not in needed:",
            ),
        ),
    ),
    Mutant(
        "clear-takes-from-living",
        "an operator's clear takes a zone from a holder that is alive",
        (
            Edit(
                ZONES,
                "        if self.state in (ZoneState.GRANTED, ZoneState.OCCUPIED):\n            return False",
                "        if False:\n            return False",
            ),
        ),
    ),
    Mutant(
        "a-wish-does-not-age",
        "a robot of low priority is overtaken for ever",
        (
            Edit(
                "cell/manager/zone_turns.py",
                "                    self._places[name, wish.robot].overtaken += 1\n",
                "                    self._places[name, wish.robot].overtaken += 0\n",
            ),
        ),
        bench=Bench.SCENE,
    ),
    Mutant(
        "tokens-repeat",
        "two grants carry the same token",
        (Edit("cell/manager/core.py", "        self._tokens += 1\n", "        self._tokens = 1\n"),),
    ),
    Mutant(
        "adopt-among-several",
        "an operator's adopt gives a zone to one robot although another may be inside",
        (Edit(ZONES, "        if self.suspects.keys() != {robot}:", "        if robot not in self.suspects:"),),
    ),
    Mutant(
        "breach-does-not-stop",
        "a robot inside without a grant is told of, and nothing is stopped",
        (
            Edit(
                "cell/manager/core.py",
                "        self._stop_all(where, now)",
                "        _ = now",
            ),
        ),
    ),
    Mutant(
        "suspect-struck-off-inside",
        "a suspect is struck off while it is measured inside",
        (
            Edit(
                ZONES,
                "if sight is not None and sight.fresh and not sight.inside and self._has_let_go(robot, sight):",
                "if sight is not None and sight.fresh and self._has_let_go(robot, sight):",
            ),
        ),
    ),
    Mutant(
        "epoch-stays",
        "a manager that starts has the epoch of the one before it",
        (
            Edit(
                "cell/manager/records.py",
                "    return max(stored + 1, int(1000.0 * unix_s))",
                "    return max(stored, 1)",
            ),
        ),
    ),
    Mutant(
        "estop-not-restored",
        "a manager that starts has forgotten the stop that was in force",
        (
            Edit(
                "cell/manager/estop_latch.py",
                "self._estops = ListedEstops(stored.estops, stored.cleared)",
                "self._estops = ListedEstops((), stored.cleared)",
            ),
        ),
    ),
    Mutant(
        "unknown-body-granted",
        "a robot that does not know where it is gets a zone",
        (
            Edit(
                ZONES,
                " and robot in self.queue and sight.known",
                " and robot in self.queue",
            ),
        ),
    ),
    Mutant(
        "other-digest-granted",
        "a robot with another configuration gets grants",
        (
            Edit(
                "cell/manager/presences.py",
                "        if robot.presence is None or robot.presence.digest == self._digest:",
                "        if True:",
            ),
        ),
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
    # 5.1: how blocks join
    Mutant(
        "block-from-anywhere",
        "a gateway takes a block that does not begin where the queue is",
        (Edit(JOINING, "        if (gap > POSITION_TOLERANCE).any():", "        if False:"),),
    ),
    Mutant(
        "late-block-taken",
        "a gateway takes a block whose first sample should have been sent before",
        (Edit(PLAYOUT, "        if block.first_tick <= self.tick:", "        if False:"),),
    ),
    Mutant(
        "overtaken-block-taken",
        "a gateway takes a block that was overtaken by a newer one",
        (Edit(PLAYOUT, "        if block.sequence <= self.block:", "        if False:"),),
    ),
    Mutant(
        "block-without-end",
        "a gateway takes a block that does not end at rest",
        (
            Edit(
                JOINING,
                "        if (np.abs(block.velocity[-1]) > VELOCITY_TOLERANCE).any():",
                "        if False:",
            ),
            Edit(JOINING, "        if sample == len(change) - 1:", "        if False:"),
            Edit(
                JOINING,
                "        hard = change > self._acceleration_bound\n",
                "        hard = change[:-1] > self._acceleration_bound\n",
            ),
        ),
    ),
    Mutant(
        "event-twice",
        "a digital output switches again each time a block repeats its event",
        (
            Edit(
                "drive_gateway/gateway/playout/outputs.py",
                "over = event.number <= self.played or event.number in self._early",
                "over = False",
            ),
        ),
    ),
    Mutant(
        "output-stays-on",
        "an output that goes off at a stop stays on",
        (Edit("drive_gateway/gateway/playout/outputs.py", "        self._meant &= ~places\n", ""),),
    ),
    Mutant(
        "output-after-stop",
        "what blocks were to switch is switched after the robot was stopped",
        (
            Edit(
                PLAYOUT,
                "        if why:\n            self._outputs.stop(why)",
                "        if False:\n            self._outputs.stop(why)",
            ),
        ),
    ),
    Mutant(
        "late-cycle-goes-on",
        "a bus cycle that came far too late is followed by the next sample",
        (
            Edit(
                "drive_gateway/gateway/core.py",
                "        if lateness > self._settings.overrun_limit_s:",
                "        if False:",
            ),
        ),
    ),
    Mutant(
        "owner-replaced-while-alive",
        "a second agent gets a robot that has an owner",
        (
            Edit(
                "drive_gateway/gateway/robots/claims.py",
                "        if self.owner:\n            silent_s",
                "        if False:\n            silent_s",
            ),
        ),
    ),
    Mutant(
        "claim-ends-in-motion",
        "the claim of a silent owner ends while its robot moves",
        (
            Edit(
                "drive_gateway/gateway/robots/claims.py",
                "if not self.owner or not at_rest or now",
                "if not self.owner or now",
            ),
        ),
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
    # 6: deadlines
    Mutant(
        "blind-agent-goes-on",
        "an agent sends blocks although it hears nothing of its drives",
        (
            Edit(
                CORE,
                "        if age_s <= max(_STALE_CYCLES * planner.cycle_s, self._cell.times.lead_s):",
                "        if True:",
            ),
        ),
    ),
    Mutant(
        "lost-feedback-no-fault",
        "drives that are not heard for long are no fault",
        (
            Edit(
                CORE,
                "        elif self.link.age(now) > self._cell.times.feedback_lost_s:\n            self._stop(",
                "        elif False:\n            self._stop(",
            ),
        ),
    ),
    Mutant(
        "goes-on-without-manager",
        "a robot keeps its rate although the manager is silent",
        (
            Edit(
                "robot_agent/agent/step/doing.py",
                '        requests = list(self.pace.requests)\n        if not self.zones.fresh(now):\n            requests.append(RateRequest(0.0, "the manager is silent"))\n        if self.mode is not Mode.RUNNING:',
                "        requests = list(self.pace.requests)\n        if self.mode is not Mode.RUNNING:",
            ),
        ),
    ),
    Mutant(
        "goes-on-by-itself",
        "a robot goes on when the manager is back although the cell leaves that to an operator",
        (
            Edit(
                "robot_agent/agent/step/progress.py",
                "        elif not self.zones.fresh(now) and self.on_manager_return is OnManagerReturn.OPERATOR:",
                "        elif False:",
            ),
        ),
    ),
    Mutant(
        "silent-claims-for-ever",
        "the claim of an agent that is gone never ends",
        (
            Edit(
                "drive_gateway/gateway/robots/claims.py",
                "        self.end()\n        return True",
                "        return False",
            ),
        ),
    ),
    Mutant(
        "emcy-ignored",
        "an emergency message of a drive stops nothing",
        (
            Edit(
                "drive_gateway/gateway/nodes/node.py",
                "            self._troubles.append(Trouble(EMERGENCY, text, emergency.remedy, self.id, emergency.code, stops, again))",
                "            _ = text",
            ),
            Edit(
                "drive_gateway/gateway/watch/watch.py",
                "            if node.status in _FAULT and not self._in_fault:",
                "            if False:",
            ),
        ),
    ),
    Mutant(
        "silent-node-plays-on",
        "a node that sends nothing any more is not missed",
        (
            Edit(
                "drive_gateway/gateway/nodes/node.py",
                "        if longest_s > self._settings.tpdo_timeout_s:",
                "        if False:",
            ),
            Edit(
                "drive_gateway/gateway/nodes/node.py",
                "        if silent_s > self._settings.heartbeat_timeout_s:",
                "        if False:",
            ),
        ),
    ),
    Mutant(
        "following-error-ignored",
        "an axis that does not follow is not stopped by the gateway",
        (Edit("drive_gateway/gateway/watch/watch.py", "        if found is not None:", "        if False:"),),
    ),
    Mutant(
        "jog-key-never-lost",
        "a jog goes on although its key is not heard any more",
        (
            Edit(
                "robot_agent/agent/operator/jogging.py",
                "        elif now - self._alive_at >= HELD_S:",
                "        elif False:",
            ),
        ),
        bench=Bench.SCENE,
    ),
    Mutant(
        "gateway-ignores-estop",
        "a gateway leaves the drives on under an emergency stop",
        (
            Edit(
                "drive_gateway/gateway/core.py",
                "        if estop is not None and self._estop_since is not None:",
                "        if False:",
            ),
        ),
    ),
    Mutant(
        "reset-while-moving",
        "a fault is acknowledged, and the voltage goes, while an axis still moves",
        (
            Edit(
                GROUP,
                '        """Acknowledge a fault, only at rest. Nothing moves and nothing is enabled by this."""\n'
                "        match self.power.state:\n            case PowerState.FAULT if problem := self.permits.restless():",
                '        """Acknowledge a fault, only at rest. Nothing moves and nothing is enabled by this."""\n'
                '        problem = ""\n        match self.power.state:\n            case PowerState.FAULT if problem:',
            ),
            Edit(
                "drive_gateway/gateway/drives/power.py",
                "        return all(node.rest.standing for node in self._nodes)",
                "        return True",
            ),
        ),
    ),
    Mutant(
        "old-order-carried-out",
        "an operator's order is carried out however old it is",
        (Edit("robot_agent/agent/operator/operator.py", "        if age_s > self._command_s:", "        if False:"),),
    ),
    Mutant(
        "wanted-while-stopped",
        "what an operator wanted under an emergency stop is carried out when that has just been reset",
        (Edit("robot_agent/agent/operator/operator.py", " and seen <= self._stopped_in:", " and False:"),),
        bench=Bench.SCENE,
    ),
    Mutant(
        "old-order-to-manager",
        "the manager carries out an order however old it is",
        (
            Edit(
                "cell/manager/core.py",
                '        if age_s <= allowed_s:\n            return ""\n        found = "no longer known" if age_s == inf',
                '        if True:\n            return ""\n        found = "no longer known" if age_s == inf',
            ),
        ),
    ),
    Mutant(
        "old-order-to-gateway",
        "a gateway carries out an operator's order however old it is",
        (
            Edit(
                "drive_gateway/gateway/orders/calls.py",
                "self._states, self._command_s + self._state_s,",
                "self._states, inf,",
            ),
        ),
    ),
    Mutant(
        "stop-ended-by-anybody",
        "agents and gateways believe the end of an emergency stop from anybody",
        (
            Edit(
                "cell/net/estops.py",
                "        if estop.id not in self._over:\n            return False\n",
                "",
            ),
        ),
    ),
    Mutant(
        "stop-ended-at-gateways",
        "gateways alone believe the end of an emergency stop from anybody",
        (
            Edit(
                "drive_gateway/gateway/core.py",
                "        if not self._estops.hear(estop):\n            return\n",
                "        if not estop.active:\n            self._estops._over.add(estop.id)\n"
                "        if not self._estops.hear(estop):\n            return\n",
            ),
        ),
    ),
    Mutant(
        "frames-carry-the-sample-before",
        "the frames to the drives carry the sample before the one that the gateway says it commands",
        (
            Edit(
                GROUP,
                "        self._sent.add(position)\n        counts = self._units.counts(position)\n",
                "        counts = self._units.counts(self._sent.newest)\n        self._sent.add(position)\n",
            ),
        ),
    ),
    Mutant(
        "estop-confirmed-in-motion",
        "a gateway confirms an emergency stop before its robots stand",
        (
            Edit(
                "drive_gateway/gateway/core.py",
                "        if estop is None or not all(robot.group.standstill.secured for robot in self._robots.values()):",
                "        if estop is None:",
            ),
        ),
    ),
    Mutant(
        "stop-plays-on",
        "a quick stop lets the queue play on",
        (
            Edit(
                GROUP,
                "        self.playout.stop()\n        self.watch.forget_rest()",
                "        self.watch.forget_rest()",
            ),
        ),
    ),
    Mutant(
        "halt-ignored",
        "`halt` is answered, and the robot goes on",
        (
            Edit(
                "robot_agent/agent/step/doing.py",
                "        if self.mode is not Mode.RUNNING:\n            requests.append",
                "        if self.mode is Mode.JOGGING:\n            requests.append",
            ),
        ),
    ),
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
)
