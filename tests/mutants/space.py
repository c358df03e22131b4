"""Faults of cleared space (docs/architecture.md, 4.5): of its rules, of how it is cut, and of who keeps to it."""

from tests.mutants.findings import CORE
from tests.mutants.mutant import Bench, Edit, Mutant

LEDGER = "cell/manager/separation/ledger.py"
ASSURANCES = "cell/manager/separation/assurances.py"
NEARNESS = "cell/manager/separation/nearness.py"
OWNED = "robot_agent/agent/space/owned_space.py"
SECTIONS = "robot_agent/workspace/sections.py"
DOING = "robot_agent/agent/step/doing.py"

_LOOK = "        return self.space.owns(used) or self.space.contains(executive.passed(feedback, None), used)"
_HOLDS = (
    "        return [*self.zones.holds_on(planned, tau, now), *self.space.holds_on(planned, self.corrections.beside_m)]"
)
_NO_HOLDS = "        return [*self.zones.holds_on(planned, tau, now)]"

SPACE = (
    # The protocol
    Mutant(
        "cleared-forgotten",
        "the manager forgets what it has cleared at the next presence, confirmed or not",
        (
            Edit(
                LEDGER,
                "            robot.open = {number: cleared for number, cleared in robot.open.items() if number > presence.taken}",
                "            robot.open = {}",
            ),
        ),
        bench=Bench.LINE,
    ),
    Mutant(
        "only-committed-reserved",
        "the manager reserves what a robot was sent, not what it may use",
        (
            Edit(
                LEDGER,
                "        robot.owned = way.sections[: way.owned]\n",
                "        robot.owned = way.sections[: way.committed]\n",
            ),
        ),
        bench=Bench.LINE,
    ),
    Mutant(
        "late-clearance-used",
        "an agent takes a clearance that it has passed over before",
        (
            Edit(
                OWNED,
                "        if clearance.epoch < self.epoch or clearance.owner != self.owner or clearance.number <= self.taken:\n"
                "            return False\n        self.taken = clearance.number\n",
                "        if clearance.epoch < self.epoch or clearance.owner != self.owner:\n"
                "            return False\n        self.taken = max(self.taken, clearance.number)\n",
            ),
        ),
        bench=Bench.LINE,
    ),
    Mutant(
        "clears-before-all-named-it",
        "a manager clears space before every robot has named it",
        (Edit(LEDGER, "        if awaited := self.awaited:\n", "        if awaited := []:\n"),),
        bench=Bench.LINE,
    ),
    Mutant(
        "epoch-ignored",
        "an agent takes what a manager of before has cleared",
        (
            Edit(
                OWNED,
                "        if epoch > self.epoch:\n            self.epoch, self.taken = epoch, 0\n            self._asked.clear()\n",
                "        if epoch != self.epoch:\n            self.epoch, self.taken = epoch, 0\n",
            ),
        ),
        bench=Bench.LINE,
    ),
    Mutant(
        "claim-without-epoch",
        "a new agent does not learn from its claim which managers are over",
        (
            Edit(
                OWNED,
                "        return type(self)(owner, max(epoch, self.epoch))",
                "        return type(self)(owner, self.epoch)",
            ),
        ),
        "an old manager has to hear this robot and not the other one; the tests of SharedSpace see it",
        bench=Bench.ROOM,
    ),
    Mutant(
        "thrown-away-comes-back",
        "a clearance that does not continue what an agent owns counts later",
        (
            Edit(
                OWNED,
                "        self.ids = frozenset(way[:owned])\n",
                "        self.ids = frozenset(way[:owned]) if renounce else self.ids | frozenset(way[:owned])\n",
            ),
        ),
        bench=Bench.LINE,
    ),
    Mutant(
        "forced-not-reserved",
        "where a robot is by force the manager keeps nothing for it",
        (
            Edit(
                LEDGER,
                "        return Whereabouts.RESERVED if known.issuperset(robot.owned.ids.tolist()) else Whereabouts.BESIDE",
                "        if known.issuperset(robot.owned.ids.tolist()):\n"
                "            return Whereabouts.RESERVED\n"
                "        robot.owned = robot.owned[np.flatnonzero(np.isin(robot.owned.ids, list(known)))]\n"
                "        return Whereabouts.BESIDE",
            ),
            Edit(
                LEDGER,
                "from cell.messages import Body, Presence\n",
                "import numpy as np\n\nfrom cell.messages import Body, Presence\n",
            ),
        ),
        bench=Bench.ROOM,
    ),
    Mutant(
        "appears-untold",
        "a robot that is heard first in space of another one stops nobody",
        (
            Edit(
                LEDGER,
                "            return Whereabouts.APPEARED\n",
                "            return Whereabouts.RESERVED\n",
            ),
        ),
        bench=Bench.SCENE,
    ),
    Mutant(
        "asks-before-it-looks",
        "a zone in which a robot's plan ends is asked for while what comes after it is still being planned",
        (
            Edit(
                "robot_agent/agent/step/doing.py",
                "        planning = self.run.lookahead.plans_more\n",
                "        planning = False\n",
            ),
        ),
        bench=Bench.SCENE,
    ),
    Mutant(
        "zones-beside-the-order",
        "a zone is granted without a look at who must get through before",
        (
            Edit(
                "cell/manager/zone_turns.py",
                "            if why := why_not_yet(wish.robot, wish.zones):\n",
                "            if why := None:\n",
            ),
        ),
        bench=Bench.SCENE,
    ),
    Mutant(
        "let-in-without-order",
        "a robot is cleared as far as nothing is in its way now, whoever must still get through",
        (
            Edit(
                LEDGER,
                "        admitted, why = order.admitted(name, ask.pieces[:cleared])\n",
                "        admitted, why = cleared, refusal\n",
            ),
        ),
        bench=Bench.SITUATION,
    ),
    Mutant(
        "a-bay-anywhere",
        "any place counts as one where nobody still has to pass",
        (
            Edit(
                "cell/manager/separation/order.py",
                "                clear &= shared.last[here + 1 :] < its\n",
                "                clear &= its >= 0\n",
            ),
        ),
        bench=Bench.SITUATION,
    ),
    # Operators' words
    Mutant(
        "box-forgotten",
        "others go into the box to which an operator has confined a robot",
        (
            Edit(
                LEDGER,
                "            return self._separation.first_at_box(name, asked, other, robot.box)\n",
                "            return None\n",
            ),
        ),
        bench=Bench.ROOM,
    ),
    Mutant(
        "stored-word-at-once",
        "what operators said under a manager of before counts before the robot is known to be lost or silent",
        (
            Edit(
                ASSURANCES,
                "            elif robot in self._stored and (_is_lost(sighting) or now - self._started > self._silent_s):\n",
                "            elif robot in self._stored:\n",
            ),
        ),
        "a manager has to start while that robot is cut off and owns more than its box; the tests of Assurances see it",
        bench=Bench.ROOM,
    ),
    # How space is cut, and measured
    Mutant(
        "no-stray",
        "sections have no room for a quick stop that leaves the path",
        (Edit(SECTIONS, "    radii = path.radii + stray\n", "    radii = path.radii + 0.0 * stray\n"),),
        bench=Bench.SCENE,
    ),
    Mutant(
        "no-chord",
        "sections have no room for the way within them",
        (
            Edit(
                SECTIONS,
                "        radii = radii + np.maximum.reduceat(away + bulge[:, None], firsts - firsts[0])",
                "        radii = radii + np.maximum.reduceat(0.0 * away + bulge[:, None], firsts - firsts[0])",
            ),
        ),
    ),
    Mutant(
        "no-following",
        "sections have no room for what a robot follows behind",
        (Edit(SECTIONS, "    return of_points(points, radii + FOLLOWING_M)", "    return of_points(points, radii)"),),
        bench=Bench.SCENE,
    ),
    Mutant(
        "margin-forgotten",
        "what nearly touches is not too near",
        (
            Edit(
                NEARNESS,
                "        return self._margins_m.get(frozenset((robot, other)), self._margin_m)",
                "        return 0.0 * self._margins_m.get(frozenset((robot, other)), self._margin_m)",
            ),
        ),
        bench=Bench.ROOM,
    ),
    Mutant(
        "distance-of-another-section",
        "what was measured of a section is remembered without the other robot's",
        (
            Edit(
                NEARNESS,
                "        at, other_at = _places(self._rows, asked.ids, self._table), "
                "_places(self._columns, reserved.ids, self._table.T)\n",
                "        at, other_at = _places(self._rows, asked.ids, self._table), np.arange(len(reserved))\n",
            ),
        ),
        bench=Bench.ROOM,
    ),
    Mutant(
        "parting-approaches",
        "robots that are too near already may come nearer",
        (
            Edit(
                NEARNESS,
                "        np.minimum.at(kept, (near.link, near.other_link), near.distance - _ROUNDING_M)",
                "        np.minimum.at(kept, (near.link, near.other_link), near.distance - 0.1)",
            ),
        ),
        bench=Bench.SCENE,
    ),
    # Who keeps to it
    Mutant(
        "no-hold-at-the-end",
        "an agent does not slow down in front of the end of what it owns",
        (Edit(DOING, _HOLDS, _NO_HOLDS),),
        bench=Bench.ROOM,
    ),
    Mutant(
        "sends-without-a-look",
        "an agent sends a block without a look at what it owns",
        (Edit(CORE, _LOOK, "        return True"),),
        "the hold at the end of what it owns leads no block farther; this look is the second one",
        bench=Bench.ROOM,
    ),
    Mutant(
        "sends-into-the-unowned",
        "an agent neither holds at the end of what it owns nor looks at that before it sends",
        (Edit(CORE, _LOOK, "        return True"), Edit(DOING, _HOLDS, _NO_HOLDS)),
        bench=Bench.ROOM,
    ),
    Mutant(
        "rear-by-the-command",
        "an agent gives back what it is commanded out of, wherever it is measured",
        (
            Edit(
                "robot_agent/agent/blocks/executive.py",
                "        spans = self.timeline.spans(tick, candidate)\n        pieces = ",
                "        spans = self.timeline.spans(feedback.tick, candidate)\n        pieces = ",
            ),
        ),
        bench=Bench.ROOM,
    ),
    Mutant(
        "rear-by-the-way-back",
        "an agent gives back the way there where its robot is as near to a place on the way back",
        (
            Edit(
                "robot_agent/agent/blocks/executive.py",
                "        near = int(np.argmax(distances <= max(least, FOLLOWING_M)))",
                "        near = int(np.argmin(distances))",
            ),
        ),
        bench=Bench.SCENE,
    ),
    Mutant(
        "back-in-what-it-left",
        "on the way back a robot is taken to be on the way there again, which it has given back",
        (Edit(CORE, "        executive.leave(passed)\n", ""),),
        bench=Bench.SCENE,
    ),
    Mutant(
        "jog-is-not-held",
        "a jog goes on beyond what its robot owns",
        (
            Edit(
                "robot_agent/agent/zones/zone_guard.py",
                "            if reason := planner.things.in_the_way(path, cover) or self._space.outside(path):",
                "            if reason := planner.things.in_the_way(path, cover):",
            ),
        ),
        bench=Bench.SCENE,
    ),
)
