"""Faults of which a first version of the simulation of the whole cell found none: deadly ones, one line each."""

from tests.mutants.mutant import Bench, Edit, Mutant

ZONES = "cell/manager/zones.py"
CLAIMS = "robot_agent/agent/zones/zone_claims.py"
CORE = "robot_agent/agent/core.py"

FINDINGS = (
    Mutant(
        "silent-holder-freed",
        "the zone of a holder that falls silent is given to the next",
        (Edit(ZONES, 'self._orphan({holder}, f"{holder} fell silent and may be inside")', "self._free()"),),
    ),
    Mutant(
        "grant-not-fenced",
        "a presence that was sent before a grant was heard ends that grant",
        (
            Edit(
                ZONES,
                "elif sight.holds == self.token or sight.echo < self._granted_in:",
                "elif sight.holds == self.token:",
            ),
        ),
    ),
    Mutant(
        "given-up-token-taken-again",
        "an agent takes up a grant that it has let go and that may be another's by now",
        (
            Edit(
                CLAIMS,
                "if token is not None and token != self._given_up.get(name) and name in inside | needed:",
                "if token is not None and name in inside | needed:",
            ),
        ),
    ),
    Mutant(
        "grants-before-all-reported",
        "a manager that starts grants zones before every robot has said where it is",
        (
            Edit(
                ZONES,
                "self.state is ZoneState.FREE and not self.awaited and",
                "self.state is ZoneState.FREE and",
            ),
        ),
    ),
    Mutant(
        "freezes-unnoticed",
        "a process that stood still for seconds believes what it finds in its queue",
        (
            Edit("cell/manager/presences.py", "        self._sent.forget()\n", "        pass\n"),
            Edit(CLAIMS, "        self.sent.forget()\n", "        pass\n"),
        ),
        bench=Bench.SCENE,
    ),
    Mutant(
        "old-news-accepted",
        "messages that were overtaken, or come from a boot that was replaced, count as news",
        (
            Edit(
                "cell/net/freshness.py",
                "(era == self.era and boot != self.boot):\n            return False",
                "(era == self.era and boot != self.boot):\n            return True",
            ),
        ),
    ),
    Mutant(
        "agent-ignores-estop",
        "an agent does not listen to emergency stops",
        (Edit(CORE, "        if self._estops.hear(estop) and estop.active:", "        if False and estop.active:"),),
    ),
    Mutant(
        "age-by-arrival",
        "whatever echoes any remembered message is fresh, however old",
        (
            Edit(
                "cell/net/freshness.py",
                "return inf if sent is None else now - sent",
                "return inf if sent is None else 0.0",
            ),
        ),
    ),
    Mutant(
        "claims-forgotten",
        "a manager that starts does not take over the grants that robots still hold",
        (Edit(ZONES, "        if not strangers:\n            return", "        if True:\n            return"),),
    ),
    Mutant(
        "ready-after-fault",
        "a fault ends without an operator",
        (
            Edit(
                "robot_agent/agent/mode.py",
                "    (ModeEvent.CLEARED, (Mode.ESTOP,), Mode.DISABLED),",
                "    (ModeEvent.CLEARED, (Mode.ESTOP, Mode.FAULT), Mode.DISABLED),",
            ),
        ),
    ),
    Mutant(
        "any-owner-played",
        "a gateway plays the blocks of an agent that was replaced",
        (
            Edit(
                "drive_gateway/gateway/playout/playout.py",
                "        return self.owner != 0 and block.owner == self.owner",
                "        return True",
            ),
        ),
    ),
    Mutant(
        "occupied-is-free",
        "a zone that its holder lets go is free although its body is inside",
        (
            Edit(
                ZONES,
                "        elif sight.inside:\n            self.state = ZoneState.OCCUPIED\n        elif sight.holds",
                "        elif sight.holds",
            ),
        ),
    ),
    Mutant(
        "joins-one-sample-on",
        "a block continues the one before it one sample too late",
        (
            Edit(
                "robot_agent/agent/blocks/sources.py",
                "        previous, index = base.segment, base.index(tick)\n",
                "        previous, index = base.segment, base.index(tick) + 1\n",
            ),
        ),
    ),
    Mutant(
        "no-holds-at-zones",
        "the governor is not told to stop in front of a zone that is not granted",
        (
            Edit(
                CLAIMS,
                "            if not self.permitted(crossing.zone, now)\n        ]",
                "            if False\n        ]",
            ),
        ),
    ),
    Mutant(
        "no-second-look",
        "the last check before a block leaves, whether its body enters a zone that is not permitted, is left out",
        (
            Edit(
                CORE,
                "        if not all(self.zones.permitted(zone, now) for zone in self._announcer.entered(passed.body)):",
                "        if False:",
            ),
        ),
    ),
    Mutant(
        "grant-never-stale",
        "an agent relies on a grant whose manager it has not heard for long",
        (
            Edit(
                CLAIMS,
                "            and self.fresh(now)\n            and status.state in",
                "            and status.state in",
            ),
        ),
    ),
    Mutant(
        "body-without-next-block",
        "the presence does not cover the block that is sent after it",
        (
            Edit(
                CORE,
                "        passed = executive.passed(feedback, block)\n        used",
                "        passed = executive.passed(feedback, None)\n        used",
            ),
        ),
    ),
)
