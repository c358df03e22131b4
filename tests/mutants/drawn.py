"""Faults drawn by lot: `python -m tests.mutants.draw --seed 2026`."""

from tests.mutants.mutant import Edit, Mutant

DRAWN: tuple[Mutant, ...] = (
    Mutant(
        "drawn-01",
        "drop a condition, cell/manager/deadlock.py line 36",
        (
            Edit(
                "cell/manager/deadlock.py",
                "        if zone.holder is not None and zone.state in (ZoneState.GRANTED, ZoneState.OCCUPIED):\n",
                "        if zone.state in (ZoneState.GRANTED, ZoneState.OCCUPIED):\n",
            ),
        ),
        "a zone that is granted or occupied always has a holder",
    ),
    Mutant(
        "drawn-02",
        "drop a condition, robot_agent/agent/program/interruption.py line 132",
        (
            Edit(
                "robot_agent/agent/program/interruption.py",
                "        if self._wanted is None or self._wanted[1] is not None or self._stretch is None or zones is None:\n",
                "        if self._wanted is None or self._stretch is None or zones is None:\n",
            ),
        ),
    ),
    Mutant(
        "drawn-03",
        "drop a condition, drive_gateway/gateway/orders/setup_turn.py line 166",
        (
            Edit(
                "drive_gateway/gateway/orders/setup_turn.py",
                "        if state is None or state.setup is None or state.setup.robot != name:\n",
                "        if state.setup is None or state.setup.robot != name:\n",
            ),
        ),
    ),
    Mutant(
        "drawn-04",
        "drop a condition, cell/net/freshness.py line 56",
        (
            Edit(
                "cell/net/freshness.py",
                "        if (era, sequence) <= (self.era, self.sequence) or (era == self.era and boot != self.boot):\n",
                "        if era == self.era and boot != self.boot:\n",
            ),
        ),
    ),
    Mutant(
        "drawn-05",
        "skip a call, cell/manager/journal.py line 118",
        (
            Edit(
                "cell/manager/journal.py",
                "                self._db.execute(sql, values)\n",
                "                pass\n",
            ),
        ),
    ),
    Mutant(
        "drawn-06",
        "skip a call, robot_agent/agent/zones/zone_claims.py line 128",
        (
            Edit(
                "robot_agent/agent/zones/zone_claims.py",
                "        self._touched.append((body, touched))\n",
                "        pass\n",
            ),
        ),
        "without what it remembers the same answer is worked out again",
    ),
    Mutant(
        "drawn-07",
        "skip a call, drive_gateway/gateway/orders/calls.py line 152",
        (
            Edit(
                "drive_gateway/gateway/orders/calls.py",
                "                    self._command(robot, command, call)\n",
                "                    pass\n",
            ),
        ),
    ),
    Mutant(
        "drawn-08",
        "skip a call, cell/net/liveliness.py line 40",
        (
            Edit(
                "cell/net/liveliness.py",
                "            self._gone.clear()\n",
                "            pass\n",
            ),
        ),
    ),
    Mutant(
        "drawn-09",
        "swap two lines, cell/manager/core.py line 115",
        (
            Edit(
                "cell/manager/core.py",
                '            text = f"emergency stop by {estop.by}: {estop.reason}"\n            self._tell(Severity.ALARM, "estop", text, "find the cause, then `cell reset`")\n',
                '            self._tell(Severity.ALARM, "estop", text, "find the cause, then `cell reset`")\n            text = f"emergency stop by {estop.by}: {estop.reason}"\n',
            ),
        ),
    ),
    Mutant(
        "drawn-10",
        "swap two lines, robot_agent/agent/step/doing.py line 158",
        (
            Edit(
                "robot_agent/agent/step/doing.py",
                '        if not blocking:\n            return Cause("")\n        zone, hold = min(blocking, key=lambda held: held[1].tau)\n',
                '        zone, hold = min(blocking, key=lambda held: held[1].tau)\n        if not blocking:\n            return Cause("")\n',
            ),
        ),
    ),
    Mutant(
        "drawn-11",
        "swap two lines, drive_gateway/gateway/playout/outputs.py line 30",
        (
            Edit(
                "drive_gateway/gateway/playout/outputs.py",
                "        self._places = tuple(((output.axis, output.io), output.bit) for output in outputs)\n        self._leads = tuple(round(output.lead_s / cycle_s) for output in outputs)\n",
                "        self._leads = tuple(round(output.lead_s / cycle_s) for output in outputs)\n        self._places = tuple(((output.axis, output.io), output.bit) for output in outputs)\n",
            ),
        ),
        "the two lines do not depend on each other",
    ),
    Mutant(
        "drawn-12",
        "swap two lines, cell/net/session.py line 274",
        (
            Edit(
                "cell/net/session.py",
                '    if good is not None:\n        try:\n            return decode(Reply, good.payload.to_bytes())\n        except CodecError as error:\n            raise CallFailed(to, verb, f"answered with something that is no reply ({error})") from error\n    failed = next(reply.err for reply in replies if reply.err is not None)\n',
                '    failed = next(reply.err for reply in replies if reply.err is not None)\n    if good is not None:\n        try:\n            return decode(Reply, good.payload.to_bytes())\n        except CodecError as error:\n            raise CallFailed(to, verb, f"answered with something that is no reply ({error})") from error\n',
            ),
        ),
    ),
    Mutant(
        "drawn-13",
        "turn a comparison, cell/manager/journal.py line 202",
        (
            Edit(
                "cell/manager/journal.py",
                "            if self._waiting and self._waiting[0] is record:\n",
                "            if self._waiting and self._waiting[0] is not record:\n",
            ),
        ),
    ),
    Mutant(
        "drawn-14",
        "turn a comparison, robot_agent/agent/zones/zone_claims.py line 153",
        (
            Edit(
                "robot_agent/agent/zones/zone_claims.py",
                "            elif name not in inside and (token is None or name not in needed):\n",
                "            elif name not in inside and (token is not None or name not in needed):\n",
            ),
        ),
    ),
    Mutant(
        "drawn-15",
        "turn a comparison, drive_gateway/gateway/drives/rest.py line 40",
        (
            Edit(
                "drive_gateway/gateway/drives/rest.py",
                "        if self._silent_since is not None:\n",
                "        if self._silent_since is None:\n",
            ),
        ),
    ),
    Mutant(
        "drawn-16",
        "turn a comparison, cell/net/codec.py line 102",
        (
            Edit(
                "cell/net/codec.py",
                "    if kind not in _ADAPTERS:\n",
                "    if kind in _ADAPTERS:\n",
            ),
        ),
    ),
    Mutant(
        "drawn-17",
        "drop a condition, cell/manager/journal.py line 204",
        (
            Edit(
                "cell/manager/journal.py",
                "            if self._told and not self._waiting:\n",
                "            if not self._waiting:\n",
            ),
        ),
    ),
    Mutant(
        "drawn-18",
        "drop a condition, robot_agent/agent/cell_clock.py line 33",
        (
            Edit(
                "robot_agent/agent/cell_clock.py",
                "        elif isinstance(message, DriveFeedback) and self._cycle_s > 0.0:\n",
                "        elif self._cycle_s > 0.0:\n",
            ),
        ),
    ),
    Mutant(
        "drawn-19",
        "drop a condition, drive_gateway/gateway/nodes/bring_up.py, whether a value agrees",
        (
            Edit(
                "drive_gateway/gateway/nodes/bring_up.py",
                "        if not outcome.problem and not step.agrees(outcome.data):\n",
                "        if not outcome.problem:\n",
            ),
        ),
    ),
    Mutant(
        "drawn-20",
        "drop a condition, cell/net/calls.py line 121",
        (
            Edit(
                "cell/net/calls.py",
                "        if known is not None and known.outcome is not None:\n",
                "        if known is not None:\n",
            ),
        ),
    ),
)
