# `make demo` and `make test` do all the set-up: they need Python 3.11 to 3.13, git and make.

VENV := .venv
BIN := $(VENV)/bin
IS_SUPPORTED := import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))
PYTHON ?= $(shell for name in python3 python3.13 python3.12 python3.11; do \
	$$name -c '$(IS_SUPPORTED)' 2>/dev/null && echo $$name && break; done)
PIP := $(BIN)/python -m pip --disable-pip-version-check install --quiet

.PHONY: help demo test smoke lint format docs peers performance wheel lock image clean

help:
	@echo "make demo    run the trip of G26 under six delays, with a table and plots"
	@echo "make test    run every test"
	@echo "make smoke   run short federations over every core: does the chain work here?"
	@echo "make lint    check style and types"
	@echo "make format  bring every file into the house's format"
	@echo "make docs    build the documentation as a site into build/site"
	@echo "make performance  run every benchmark beside its peers, and write docs/performance.md"
	@echo "make wheel   build the wheel and the source distribution into dist/"
	@echo "make lock    pin anew what the image installs (needs uv)"
	@echo "make image   build the image tieline (needs docker)"
	@echo "make clean   remove the environment and everything that was built"

demo: $(VENV)/runtime
	$(BIN)/tieline run g26_trip --core zmq

test: $(VENV)/development
	$(BIN)/python -m pytest --numprocesses auto --dist loadfile --no-loadscope-reorder

smoke: $(VENV)/development
	$(BIN)/python -m pytest -m smoke

lint: $(VENV)/development
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(VENV)/development
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(VENV)/development
	$(BIN)/mkdocs build --strict

# Each peer has an environment of its own: what they ask for does not fit together.
PEERS := build/peers

peers: $(PEERS)/andes/installed $(PEERS)/dpsim/installed $(PEERS)/ns3/installed

$(PEERS)/andes/installed: PEER := andes
$(PEERS)/dpsim/installed: PEER := dpsim
$(PEERS)/ns3/installed: PEER := --editable .[ns3] pytest
$(PEERS)/%/installed:
	$(PYTHON) -m venv $(@D)
	$(@D)/bin/python -m pip --disable-pip-version-check install --quiet $(PEER)
	@touch $@

performance: $(VENV)/development peers
	$(BIN)/python benchmarks/measure.py --peers $(PEERS)

wheel: $(VENV)/development
	$(BIN)/python -m build

# The versions are those of the environment that the tests ran in.
LOCK := uv pip compile --quiet --python-version 3.12 --python-platform linux --generate-hashes \
	--no-header --no-annotate --constraint $(VENV)/tested.txt

lock: $(VENV)/development
	$(BIN)/python -m pip freeze --exclude-editable > $(VENV)/tested.txt
	$(LOCK) pyproject.toml --output-file docker/requirements.lock
	echo hatchling | $(LOCK) - --output-file docker/build.lock

image:
	docker build --file docker/Dockerfile --tag tieline:latest .

$(VENV)/created:
	@test -n "$(PYTHON)" || { echo "tieline needs Python 3.11, 3.12 or 3.13; none was found" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/runtime: pyproject.toml | $(VENV)/created
	@echo "Installing tieline and what it needs into $(VENV) (a minute or two, once)"
	$(PIP) --editable .
	@echo "Compiling what a run needs (a minute or two, once)"
	@-$(BIN)/tieline run g26_trip_smoke --quiet --out $(VENV)/first_run > /dev/null
	@touch $@

$(VENV)/development: pyproject.toml | $(VENV)/created
	@echo "Installing tieline and its tools into $(VENV) (a minute or two, once)"
	$(PIP) --editable '.[dev]'
	@touch $@ $(VENV)/runtime

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find federates tests -name __pycache__ -type d -prune -exec rm -rf {} +
