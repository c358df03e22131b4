"""All planted faults."""

from tests.mutants.body import BODY
from tests.mutants.conditions import CONDITIONS
from tests.mutants.drawn import DRAWN
from tests.mutants.findings import FINDINGS
from tests.mutants.rules import RULES
from tests.mutants.space import SPACE

GROUPS = {
    "findings": FINDINGS,
    "rules": RULES,
    "space": SPACE,
    "body": BODY,
    "conditions": CONDITIONS,
    "drawn": DRAWN,
}
MUTANTS = tuple(mutant for group in GROUPS.values() for mutant in group)
