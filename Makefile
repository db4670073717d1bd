# Foldyn: `make demo` and `make test` set up all that they need in .venv.
# They ask for python3 (3.11 to 3.14) with its venv module, and make; nothing else.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMP  := $(VENV)/.installed

CASES      := src/foldyn/studies/herkal/cases
DEMO_CASES ?= case1 case2 case3 case4
DEMO_OUT   ?= demo-results
DEMO_FLAGS ?=
PYTEST_FLAGS ?=
DRAWS ?= 500
OLDEST ?= .venv-oldest
# only some of most folders: others compile long and ask nothing else of these versions
OLDEST_TESTS := tests/jit tests/mechanics/test_dihedral.py \
  $(addprefix tests/materials/test_,custom_laws.py registered_laws.py series.py) \
  $(addprefix tests/results/test_,damaged_files.py missing.py pattern_states.py results.py) \
  $(addprefix tests/analyses/test_,casefile.py limits.py)
WORKERS ?= -n auto --maxprocesses 4 --dist worksteal
# each worker keeps one processor busy: with more threads for linear algebra they wait for each other
export OPENBLAS_NUM_THREADS ?= 1

.PHONY: help demo warm-up test test-all test-oldest lint format docs wheel-check clean setup
.DEFAULT_GOAL := help

help:  ## list what can be made
	@grep -E '^[a-z-]+:.*## ' Makefile | sed -E 's/^([a-z-]+):.*## /  make \1\t/' | expand -t 20
	@echo
	@echo '  PYTHON=python3.12        the interpreter that .venv is made with'
	@echo '  DEMO_CASES="case1"       a part of the demo;  DEMO_FLAGS="..." more flags of foldyn run'
	@echo '  PYTEST_FLAGS="-k mass"   more flags of pytest;  WORKERS="-n 0": one test at a time'
	@echo '  DRAWS=50                 cases that test-all draws at random; fewer than 500: fewer products, too'

# ------------------------------------------------------------------------------ set-up
$(BIN)/python:
	@command -v $(PYTHON) >/dev/null 2>&1 || { \
	  echo 'make: no "$(PYTHON)" found. Install Python 3.11 to 3.14 (Debian, Ubuntu:' \
	       'apt install python3 python3-venv), or name one: make PYTHON=python3.12' >&2; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 15))' || { \
	  echo "make: Foldyn needs Python 3.11 to 3.14, and $(PYTHON) is" \
	       "$$($(PYTHON) -V 2>&1 | cut -d' ' -f2). Name another: make PYTHON=python3.12" >&2; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { \
	  echo 'make: $(PYTHON) has no venv module. Install it (Debian, Ubuntu:' \
	       'apt install python3-venv) and call make again.' >&2; exit 1; }
	@echo 'Making $(VENV) ...'
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); exit 1; }

$(STAMP): pyproject.toml requirements.lock | $(BIN)/python
	@echo 'Installing the locked dependencies into $(VENV) (once; a few minutes) ...'
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	  --no-deps --no-build-isolation --editable .
	@touch $@

setup: $(STAMP)  ## make .venv with everything in it

# ------------------------------------------------------------------------------ use
demo: $(STAMP)  ## run the four shipped case studies; pages and figures in demo-results/
	@set -e; for name in $(DEMO_CASES); do \
	  echo "== $$name"; \
	  $(BIN)/foldyn run $(CASES)/$$name.toml --out $(DEMO_OUT)/$$name --figures png $(DEMO_FLAGS); \
	done
	@echo; echo 'The figures, and a page with all of each case:'
	@find $(DEMO_OUT) -name '*.png' -o -name 'report.html' | sort | sed 's/^/  /'

warm-up: $(STAMP)
	@$(BIN)/python -m compileall -q -j 0 src  # where PYTHONDONTWRITEBYTECODE is set, none of many processes would keep it
	@$(BIN)/foldyn warm-up  # first, so that no two workers compile the same

test: warm-up  ## run the tests that a change can plausibly break
	@$(BIN)/python -m pytest $(WORKERS) $(PYTEST_FLAGS)

test-all: warm-up  ## run these and the matrix: whole products of options, and long runs
	@DRAWS=$(DRAWS) $(BIN)/python -m pytest $(WORKERS) $(PYTEST_FLAGS) -m 'matrix or not matrix'

test-oldest: $(BIN)/python  ## run the tests of compiling, laws and results with the oldest versions that pyproject.toml allows
	@rm -rf $(OLDEST) && $(BIN)/python -m venv $(OLDEST)
	@$(BIN)/python .ci/oldest pyproject.toml > $(OLDEST)/requirements.txt
	@$(OLDEST)/bin/python -m pip install --quiet --disable-pip-version-check \
	  -r $(OLDEST)/requirements.txt
	@NUMBA_CACHE_DIR=$(OLDEST)/kernels PYTHONPATH=src $(OLDEST)/bin/python -m pytest -q \
	  -p no:cacheprovider --disable-warnings $(WORKERS) $(OLDEST_TESTS)

lint: $(STAMP)  ## ruff, pyright, the layers contract, and files that other programs read
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/lint-imports
	$(BIN)/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff
	$(BIN)/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.readthedocs .readthedocs.yaml

format: $(STAMP)  ## put the code in order
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(STAMP)  ## build the documentation and run its notebooks; every warning is an error
	$(BIN)/python -m sphinx -W --keep-going -n -q -b html docs docs/_build/html
	@echo 'The first page: docs/_build/html/index.html'

wheel-check: $(STAMP)  ## build and check sdist and wheel, install the latter into an empty environment, run a shipped case
	.ci/wheel-check $(BIN)/python

clean:  ## remove .venv and all that was built
	rm -rf $(VENV) $(OLDEST) build dist docs/_build docs/notebooks demo-results .pytest_cache .ruff_cache .import_linter_cache .hypothesis
	find src tests -name __pycache__ -type d -prune -exec rm -rf {} +
