# Everything here works from a bare clone: .venv is made on the way.
PYTHON ?=
VENV := .venv/bin
# Windows of tests open on a virtual display, never on yours.
UNSEEN := env -u DISPLAY -u WAYLAND_DISPLAY

.DEFAULT_GOAL := help
.PHONY: help setup run demo test check fuzz lint format bench acceptance faults doctor constraints clean

help: ## this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup: ## make .venv with everything in it, and install missing system libraries
	@PYTHON="$(PYTHON)" packaging/bootstrap.sh

run: setup ## open Phalanx on the built-in performer, connected and tracking
	@$(VENV)/python -m app demo

demo: setup ## the same on a virtual display: writes a take, its exports and a screenshot to phalanx-demo/
	@$(UNSEEN) $(VENV)/python -m app demo

test: setup lint ## all checks: style, types, import contracts, tests (windows on a virtual display); LONG=1: those that take minutes, too
	@$(if $(LONG),PHALANX_LONG=1) $(UNSEEN) $(VENV)/python packaging/run_tests.py

check: setup lint ## style, types, contracts and the tests that matter most, in a third of the time: before each commit
	@$(UNSEEN) $(VENV)/python packaging/run_tests.py --check

fuzz: setup ## every reader of files and packets against spoilt ones; SECONDS=600 for longer, SEED=n READER=name CASE=n to try again
	@$(UNSEEN) $(VENV)/python -m tests.fuzz --seconds $(or $(SECONDS),60) $(if $(SEED),--seed $(SEED)) $(if $(READER),--reader "$(READER)") $(if $(CASE),--case $(CASE))

lint: setup ## style, types and import contracts only
	$(VENV)/ruff check
	$(VENV)/ruff format --check
	$(VENV)/mypy
	$(VENV)/lint-imports --no-logo

format: setup ## rewrite the code in house style
	$(VENV)/ruff check --fix
	$(VENV)/ruff format

bench: setup ## median and p99 of the engine, by stage
	@$(VENV)/python -m app bench engine

acceptance: setup ## open every export in the programs it is for, which are installed for it; TABLE=docs/exports.md renews the table there
	@packaging/acceptance.sh
	PHALANX_ACCEPTANCE=1 PHALANX_TABLE_INTO=$(TABLE) $(UNSEEN) .venv-acceptance/bin/python -m pytest tests/acceptance

faults: setup ## what may go wrong on a capture day, tried on the real programs; FAULT="kill-record disk-full" some, TRIES=181 so often, TABLE=docs/faults.md renews the table there
	@$(UNSEEN) $(VENV)/python -m tests.faults $(FAULT) $(if $(TRIES),--tries $(TRIES)) $(if $(TABLE),--into $(TABLE))

doctor: setup ## what is missing on this machine, and how to get it
	@$(VENV)/python -m app doctor

constraints: setup ## renew packaging/constraints.txt with the newest versions that pyproject.toml allows
	@packaging/renew_constraints.sh

clean: ## remove everything that make and the tests have written, .venv included
	rm -rf .venv .venv-acceptance .venv-blender tests/acceptance/node_modules build dist *.egg-info phalanx-demo fuzz-failures .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
