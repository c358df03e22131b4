"""All planted faults."""

from tests.mutants.conditions import CONDITIONS
from tests.mutants.drawn import DRAWN
from tests.mutants.findings import FINDINGS
from tests.mutants.rules import RULES
from tests.mutants.space import SPACE

GROUPS = {"findings": FINDINGS, "rules": RULES, "space": SPACE, "conditions": CONDITIONS, "drawn": DRAWN}
MUTANTS = (*FINDINGS, *RULES, *SPACE, *CONDITIONS, *DRAWN)
