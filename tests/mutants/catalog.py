"""All planted faults."""

from tests.mutants.drawn import DRAWN
from tests.mutants.findings import FINDINGS
from tests.mutants.rules import RULES

GROUPS = {"findings": FINDINGS, "rules": RULES, "drawn": DRAWN}
MUTANTS = (*FINDINGS, *RULES, *DRAWN)
