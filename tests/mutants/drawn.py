from tests.mutants.mutant import Mutant

DRAWN: tuple[Mutant, ...] = ()
