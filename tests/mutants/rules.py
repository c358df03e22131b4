"""One fault for each rule of docs/architecture.md: 4.1 (zones), 5.1 (how blocks join), 6 (deadlines)."""

from tests.mutants.findings import CLAIMS, CORE, ZONES
from tests.mutants.mutant import Bench, Edit, Mutant

PLAYOUT = "drive_gateway/gateway/playout/playout.py"
JOINING = "drive_gateway/gateway/playout/joining.py"
GROUP = "drive_gateway/gateway/robots/group.py"

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
)
