# simscen: every task of the project. `make help` prints this list.
SHELL := /bin/bash
.DEFAULT_GOAL := help
VENV := .venv
BIN := $(VENV)/bin
# Interpreters that pyenv compiles without optimization come last: runs take about 10 % longer with them.
PYTHON ?= $(shell for v in 3.11 3.10 3.12 3.13; do \
	for p in $$(which -a python$$v 2>/dev/null | grep -v pyenv) $(HOME)/.local/share/uv/python/cpython-$$v.*/bin/python3 \
		python$$v $(HOME)/.pyenv/versions/$$v.*/bin/python; do \
	if command -v $$p >/dev/null 2>&1 && \
		$$p -c "import ensurepip, sys; sys.exit('%d.%d' % sys.version_info[:2] != '$$v')" 2>/dev/null; \
	then echo $$p; exit; fi; done; done)
STAMP := $(VENV)/.installed

LOWEST := .venv-lowest
LOWEST_TESTS := tests/diagnostics tests/cases $(addprefix tests/unit/,cli loading judge report run sim worlds)

ROS := .venv-ros

.PHONY: help setup run test test-lowest test-all test-ros test-nav2 served library planners check lint types layers schemas docs site mutation screenshots bench campaign fuzz build clean

help:  ## Print this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{printf "  make %-11s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

setup: $(STAMP)  ## Create the virtual environment .venv (other targets do this if necessary)

$(STAMP): pyproject.toml
	@test -n "$(PYTHON)" || { \
	echo "simscen needs Python 3.10 to 3.13 (best 3.11: pybullet is compiled for 3.12 and newer), and none was found."; \
	echo "Get one without touching your system, then run make again:"; \
	echo "    curl -LsSf https://astral.sh/uv/install.sh | sh && uv python install 3.11"; \
	echo "or name one yourself:  make $(firstword $(MAKECMDGOALS)) PYTHON=/path/to/python3.11"; exit 1; }
	@echo "Setting up $(VENV) with $(PYTHON) …"
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@$(BIN)/python -m pip install --quiet --upgrade "pip>=25.1"
	@$(BIN)/python -m pip install --quiet --editable . --group dev
	@$(BIN)/python -m compileall -q simscen  # commands start faster, also where Python may not write bytecode
	@touch $@

run: setup  ## Run the shipped scenarios
	@$(BIN)/simscen run scenarios/

test: setup  ## Run what CI runs: tests, and all checks in parallel
	@$(MAKE) --no-print-directory lint layers schemas types > $(VENV)/check.log 2>&1 & check=$$!; \
	$(BIN)/python tests/ros/rig.py $(ROS); \
	$(BIN)/python -m pytest -m "not slow"; failed=$$?; \
	wait $$check || failed=1; cat $(VENV)/check.log; exit $$failed

test-all: setup  ## Run all tests, also the slow ones that `make test` skips
	@$(BIN)/python tests/ros/rig.py $(ROS)
	@$(BIN)/python -m pytest

test-ros: setup  ## Test with a real ROS 2 (rclpy on Fast DDS, from wheels into .venv-ros)
	@$(BIN)/python tests/ros/rig.py $(ROS)
	@$(BIN)/python -m pytest tests/ros -n 2 --durations=10

test-nav2: setup  ## Test with a real Nav2: an installed one, or built from SIMSCEN_NAV2_SOURCES into .nav2
	@$(BIN)/python tests/nav2/rig.py .nav2 || exit 0; $(BIN)/python -m pytest tests/nav2 -n 0 --durations=10

test-lowest:  ## Test with the oldest packages that pyproject.toml allows, in .venv-lowest
	@test -x $(LOWEST)/bin/python || $(PYTHON) -m venv $(LOWEST)
	@$(LOWEST)/bin/python -m pip install --quiet uv
	@$(LOWEST)/bin/uv pip install --quiet --python $(LOWEST)/bin/python --resolution lowest-direct --editable .
	@$(LOWEST)/bin/uv pip freeze --quiet --exclude-editable --python $(LOWEST)/bin/python > $(LOWEST)/constraints.txt
	@$(LOWEST)/bin/uv pip install --quiet --python $(LOWEST)/bin/python --constraint $(LOWEST)/constraints.txt \
	"pytest>=8.2" "pytest-xdist>=3.6" "hypothesis>=6.100" "junitparser>=3.1" "check-jsonschema>=0.29" "shapely>=2.0" "xacro>=2.0"
	@$(LOWEST)/bin/python -m pytest -n 2 $(LOWEST_TESTS)
	@$(LOWEST)/bin/simscen run scenarios/navigation scenarios/faults --out $$(mktemp -d)/out

served: setup  ## Check that each shipped scenario gives the same log with the reference stack behind the stack protocol
	@SIMSCEN_SERVED=all $(BIN)/python -m pytest tests/scenarios/test_stack_protocol_parity.py

library: setup  ## Run each shipped scenario with twenty seeds, and update the table in the docs (minutes)
	@$(BIN)/python tests/scenarios/twenty_seeds.py

planners: setup  ## Compare all planners on the same queries, and update the table in the docs (minutes)
	@$(BIN)/python tests/planning/compare.py

check: setup  ## Check lint, spelling, types, layers, and generated files
	@$(MAKE) --no-print-directory -j 2 -O lint types layers schemas

lint: setup
	@$(BIN)/ruff check . && $(BIN)/ruff format --check --quiet .
	@$(BIN)/codespell simscen docs scenarios worlds *.md

types: setup
	@$(BIN)/mypy

layers: setup
	@$(BIN)/lint-imports --no-cache 2>&1 | tail -n 4; test $${PIPESTATUS[0]} -eq 0 || { $(BIN)/lint-imports --no-cache; exit 1; }

schemas: setup  ## Check that schemas/ and docs/reference/ are up to date
	@$(BIN)/python -m simscen.cli.catalog.generate --check

docs: setup  ## Generate schemas/ and docs/reference/
	@$(BIN)/python -m simscen.cli.catalog.generate

site: setup  ## Build the documentation site in build/site; broken links are errors
	@NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

mutation: setup  ## Mutate the code that decides verdicts, and check that tests fail (takes long)
	@nice -n 10 $(BIN)/python tests/mutation/run.py --write

screenshots: setup  ## Create the screenshots for the docs (needs Chromium)
	@$(BIN)/python tests/browser/screenshots.py
	@$(BIN)/python tests/browser/suite_screenshots.py
	@$(BIN)/python tests/browser/editor_screenshots.py
	@$(BIN)/python tests/browser/verify_screenshots.py

bench: setup  ## Measure speed (simscen bench)
	@$(BIN)/simscen bench

campaign: setup  ## Run 500 scenarios, of which a tenth crash, hang, or use too much memory
	@$(BIN)/python tests/campaign/fault_batch.py

fuzz: setup  ## Load 20 000 damaged files
	@$(BIN)/python tests/fuzz/fuzz.py

build: setup  ## Build the wheel into dist/
	@$(BIN)/python -m pip wheel --quiet --no-deps --wheel-dir dist .

clean:  ## Remove all generated files
	rm -rf $(VENV) $(LOWEST) $(ROS) dist build simscen-out .mypy_cache .pytest_cache .ruff_cache
