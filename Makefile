# Development and demonstration entry points. `make help` lists them.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
DEVELOPED := $(VENV)/.developed
CONTROLLERS := passive yaw-rate lqg lqg-scheduled h-infinity output-feedback lqr lqr-scheduled learned \
  learned-by-gradient
COMMIT ?= HEAD

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help demo report warm test lint controllers docs site reliability clients bench bench-against clean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-13s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)
	@echo "The first target run creates $(VENV) with $(PYTHON); override with PYTHON=python3.12."

demo: $(INSTALLED) ## show what railenv can do; first page of the report in results/
	$(BIN)/railenv reproduce --first-page --out results

report: $(INSTALLED) ## write the whole reproduction report to results/ (minutes)
	$(BIN)/railenv reproduce --out results

warm: $(INSTALLED) ## compile all kernels ahead of their first use (minutes)
	$(BIN)/railenv warm

test: $(DEVELOPED) ## run the tests except those marked slow
	$(BIN)/python -m pytest -n 2 --dist worksteal

lint: $(DEVELOPED) ## check style, formatting, types and the order of imports
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy railenv design agents
	$(BIN)/lint-imports

docs: $(DEVELOPED) ## regenerate the pages that are made from code and measurements
	$(BIN)/railenv vehicles --markdown > docs/vehicles.md
	$(BIN)/python docs/make_vehicle_files.py
	$(BIN)/python docs/make_environments.py --no-pictures
	$(BIN)/python docs/make_equations.py
	$(BIN)/railenv reproduce --out results && cp results/data/claims.json docs/claims.json
	$(BIN)/python -m benchmarks.simplifications
	$(BIN)/python -m benchmarks.readings.run
	$(BIN)/python docs/make_validation.py
	$(BIN)/python docs/make_learned.py
	$(BIN)/python docs/make_methods.py
	$(BIN)/python docs/make_given.py
	$(BIN)/python docs/make_diagram.py
	$(BIN)/python docs/make_pictures.py
	$(BIN)/python docs/make_curves.py
	$(BIN)/python docs/make_coaches.py
	$(BIN)/python docs/make_irregular.py
	$(BIN)/python docs/make_creep.py
	$(BIN)/python docs/make_contact.py
	$(BIN)/python docs/make_recipes.py
	$(BIN)/python docs/make_reliability.py
	$(BIN)/python docs/make_clients.py
	$(BIN)/python -m examples.reward_of_idle_and_lqr
	$(BIN)/python -m benchmarks.scaling docs/scaling.md
	$(BIN)/python -m benchmarks.run --markdown docs/benchmarks.md
	$(BIN)/python docs/make_times.py

site: $(DEVELOPED) ## build the documentation as a site in site/
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs site
	@echo "open site/index.html"

controllers: $(DEVELOPED) ## design, tune and learn the shipped controllers again (minutes)
	for kind in $(CONTROLLERS); do \
	  $(BIN)/railenv tune $$kind --out agents/controllers/data/bogie-secondary-v1/$$kind.npz; done
	for problem in bogie-primary-v1 bogie-both-v1 dual-wheelset-v1; do \
	  $(BIN)/railenv tune output-feedback --problem $$problem \
	    --out agents/controllers/data/$$problem/output-feedback.npz; done
	$(BIN)/railenv tune lqg --problem coach-v1 --out agents/controllers/data/coach-v1/lqg.npz
	for problem in coach-v1 crh380a-v1; do \
	  $(BIN)/railenv tune adaptive-lqg --problem $$problem \
	    --out agents/controllers/data/$$problem/adaptive-lqg.npz; done
	$(BIN)/railenv tune learned-adaptive --problem coach-v1 \
	  --out agents/controllers/data/coach-v1/learned-adaptive.npz

reliability: $(DEVELOPED) ## fuzz, damage files, run for hours; docs/reliability.md (15 minutes)
	$(BIN)/python -m benchmarks.reliability.run
	$(BIN)/python docs/make_reliability.py

clients: $(DEVELOPED) ## try RL libraries, each in an environment of its own; docs/clients.md (half an hour)
	$(BIN)/python -m benchmarks.clients.run
	$(BIN)/python docs/make_clients.py

bench: $(DEVELOPED) ## run the benchmarks
	$(BIN)/python -m benchmarks.run

bench-against: $(DEVELOPED) ## compare the speed with that of a commit: COMMIT=main (minutes)
	$(BIN)/python -m benchmarks.against $(COMMIT)

clean: ## remove results/, caches and build products (keeps the environment)
	rm -rf results build dist site htmlcov .coverage .coverage.* coverage.xml
	rm -rf .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis *.egg-info
	find . -path ./$(VENV) -prune -o -type d -name __pycache__ -prune -exec rm -rf {} +

# What a user installs; enough for demo and report.
$(INSTALLED): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "railenv needs Python 3.11 or newer: make PYTHON=python3.11 ..." >&2; exit 1; }
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install -c constraints.txt -e .
	@touch $@

$(DEVELOPED): $(INSTALLED)
	$(BIN)/python -m pip install -c constraints.txt -e '.[dev,rl]'
	@touch $@
