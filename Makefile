# Everything a newcomer needs: `make demo` and `make test` set up what they use; a second run installs nothing again.
#
#   make PYTHON=/path/to/python3.12 demo      use another interpreter for the virtual environment
#
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
CELL := cell_configs/two_arms/cell.yaml

# The stamps are newer than pyproject.toml exactly when its dependencies are installed.
RUN_READY := $(VENV)/.ready-run
TEST_READY := $(VENV)/.ready-test
BENCH_READY := $(VENV)/.ready-bench

# As in the commands themselves (cell/commands/start.py): the matrices are small, and spinning threads take the processor.
export OPENBLAS_NUM_THREADS ?= 1
# Tests start hundreds of processes; where bytecode is not kept, each compiles all modules again.
unexport PYTHONDONTWRITEBYTECODE

# One more than there are cores: some tests wait for answers and need no processor meanwhile.
WORKERS := $(shell expr `getconf _NPROCESSORS_ONLN` + 1)
CELLS_LOG := $(VENV)/test-cells.log

.PHONY: help demo test test-parts test-cells lint soak mutants bench clean
.DEFAULT_GOAL := help

help:  ## list the targets
	@sed -n 's/^\([a-z]*\):.*## \(.*\)/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 14

demo: $(RUN_READY)  ## run the two-robot cell on simulated drives until both programs are done
	$(BIN)/python -m cell.commands.main up $(CELL) --until-done

# The processes of a cell need the processor in time: tests of parts take, with a low priority, what they leave:
# not the lowest, since some of them wait for answers of threads of their own.
test: $(TEST_READY)  ## all tests but the long random runs
	@$(MAKE) --no-print-directory --jobs 2 test-parts test-cells

# The profile "ci" of hypothesis draws the same cases in every run; `make soak` looks for new ones.
test-parts: $(TEST_READY)
	nice -n 10 $(BIN)/python -m pytest -m "not soak" --hypothesis-profile ci tests/unit tests/sim --numprocesses $(WORKERS) --dist worksteal

test-cells: $(TEST_READY)
	@$(BIN)/python -m pytest -m "not soak" tests/e2e > $(CELLS_LOG) 2>&1; code=$$?; cat $(CELLS_LOG); exit $$code

soak: $(TEST_READY)  ## the long random runs, and every property with newly drawn cases
	$(BIN)/python -m pytest -m "soak or hypothesis" --timeout 3600

mutants: $(TEST_READY)  ## plant faults in copies of the tree: does the simulated cell find each of them?
	$(BIN)/python -m tests.mutants

lint: $(TEST_READY)  ## ruff, mypy strict, the layers of the packages
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(BENCH_READY)  ## print every number the project promises, as a ratio where a peer library exists
	$(BIN)/python -m bench

clean:  ## remove the virtual environment and all caches
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# Makes the virtual environment and installs the project into it; $(1): what to install. Complains in one line.
define install
	@$(PYTHON) -c '' 2>/dev/null || { \
	  echo "zencell: no Python found as '$(PYTHON)'; needed: Python 3.11 or newer; install it, or name it: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "zencell: found `$(PYTHON) --version 2>&1` as '$(PYTHON)'; needed: Python 3.11 or newer; install it, or name it: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { \
	  echo "zencell: `$(PYTHON) --version 2>&1` lacks the modules venv and ensurepip; install them (Debian, Ubuntu: apt install python3-venv), then: make $(MAKECMDGOALS)" >&2; exit 1; }
	@echo "zencell: installing $(1) into $(VENV); this happens once"
	@$(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --editable '$(1)'
endef

$(RUN_READY): pyproject.toml
	$(call install,.)
	@touch $@

$(TEST_READY): pyproject.toml
	$(call install,.[test])
	@touch $@ $(RUN_READY)

$(BENCH_READY): pyproject.toml
	$(call install,.[bench])
	@touch $@ $(RUN_READY)
