"""Faults of what a program asks and counts (docs/language.md: WAIT DI, IF, LET, M)."""

from tests.mutants.mutant import Bench, Edit, Mutant

RUN = "robot_agent/agent/program/program_run.py"
WAITS = "robot_agent/agent/program/waits.py"
LANGUAGE = "robot_agent/language/conditions.py"

CONDITIONS = (
    Mutant(
        "other-branch-taken",
        "an IF that does not hold goes on with the branch that does",
        (
            Edit(
                "robot_agent/language/interpreter.py",
                "        if fork is not None and fork.target is not None and not holds:",
                "        if fork is not None and fork.target is not None and holds:",
            ),
        ),
        bench=Bench.CONDITIONS,
    ),
    Mutant(
        "falls-into-else",
        "the branch before ELSE goes on into the other one",
        (
            Edit(
                LANGUAGE,
                "    def run(self, walk: Walk) -> None:\n        walk.index = self.target\n",
                "    def run(self, _walk: Walk) -> None:\n        pass\n",
            ),
        ),
        bench=Bench.CONDITIONS,
    ),
    Mutant(
        "counts-one-more",
        "a loop by a variable goes round once more than it says",
        (Edit("robot_agent/language/steps.py", '    "<": operator.lt,', '    "<": operator.le,'),),
        bench=Bench.CONDITIONS,
    ),
    Mutant(
        "halts-count-as-waiting",
        "a time-out runs while the program is halted",
        (
            Edit(
                WAITS,
                "        if step is None:\n            self._tick = None\n            return\n",
                "        if step is None:\n            return\n",
            ),
        ),
        bench=Bench.CONDITIONS,
    ),
    Mutant(
        "asks-what-was",
        "an input counts by what was measured before the robot came",
        (Edit(WAITS, "        return self._now - self._since", "        return math.inf"),),
        bench=Bench.CONDITIONS,
    ),
    Mutant(
        "force-outlives-follow",
        "programs see an input as it was forced after it was to follow again",
        (Edit("robot_agent/agent/program/forced_inputs.py", "        del self.on[name]\n", ""),),
        bench=Bench.CONDITIONS,
    ),
    Mutant(
        "flags-not-counted-in-motion",
        "a flag that nobody answers is forgotten where the next motion begins at once",
        (
            Edit(
                "robot_agent/agent/program/flag_counts.py",
                "        self.count(mark for mark in self._ahead if mark not in here)\n",
                "",
            ),
        ),
        bench=Bench.CONDITIONS,
    ),
    Mutant(
        "goto-jumps-once-more",
        "a counted GOTO jumps once more than it says",
        (Edit("robot_agent/language/sequence.py", "        if left > 0:\n", "        if left >= 0:\n"),),
        bench=Bench.CONDITIONS,
    ),
    Mutant(
        "sub-runs-once-more",
        "a subroutine runs once more than its SUB says",
        (
            Edit(
                "robot_agent/language/sequence.py",
                "SubCall(self.target, walk.index, self.count - 1, walk.jumps_left)",
                "SubCall(self.target, walk.index, self.count, walk.jumps_left)",
            ),
        ),
        bench=Bench.CONDITIONS,
    ),
    Mutant(
        "halt-forgets-outputs",
        "what is to be switched where the robot stands is lost when its program is halted just then",
        (
            Edit(
                RUN,
                "            self._held_since = tick\n",
                "            self._held_since = tick\n            self.outputs._marks.clear()\n",
            ),
        ),
        bench=Bench.CONDITIONS,
    ),
    Mutant(
        "going-back-switches",
        "outputs in front of the robot are switched when it goes back beyond its present motion",
        (
            Edit(
                RUN,
                "        if not self.running or self.trail.behind(block.path):\n            return ()\n",
                "        if not self.running:\n            return ()\n",
            ),
        ),
        bench=Bench.CONDITIONS,
    ),
    Mutant(
        "going-back-comes-to-the-next-step",
        "where the robot has come back to the end of an earlier motion, the program goes on from there",
        (
            Edit(
                RUN,
                "        arrived = arrived and not self.trail.behind(executive.timeline.newest.path)\n",
                "",
            ),
        ),
        bench=Bench.CONDITIONS,
    ),
)
