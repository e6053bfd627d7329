# Boresight. `make` sets up and runs the main job; `make test` sets up and runs the tests.
# `make help` lists the rest.

PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
OUT    ?= build
# Versions that are installed; empty for the newest (`make newest`).
LOCK   ?= constraints.txt
# The same for what packages are built with.
BUILD  ?= $(LOCK)
# Its warnings are about caches in a closed home and about editable installs as such.
PIP    := PYTHONWARNINGS=ignore PIP_CONSTRAINT="$(BUILD)" PIP_BUILD_CONSTRAINT="$(BUILD)" \
          $(BIN)/python -m pip install -qq --disable-pip-version-check $(if $(LOCK),--constraint "$(LOCK)")
UV     := UV_CUSTOM_COMPILE_COMMAND="make lock" $(BIN)/uv pip compile -q --no-annotate pyproject.toml

.DEFAULT_GOAL := main
.PHONY: main test pythons texts newest oldest soak lint types setup develop tools bench formal \
        firmware docs dist lock cross doctor clean help preflight-setup preflight-run preflight-tests

main: preflight-run setup  ## Set up, then Verilog, proof on recorded data, area, clock, report
	$(BIN)/boresight doctor --quiet
	$(BIN)/boresight demo -o $(OUT)

# Python starts hundreds of times: compiled modules are kept, whatever the environment says.
main test pythons soak: export PYTHONDONTWRITEBYTECODE :=

test: develop          ## Set up, then lint, types and all tests
	$(BIN)/boresight doctor --quiet
	$(BIN)/ruff check .
	$(BIN)/ruff format --check --quiet .
	@# Types are checked beside the tests: both cores are busy from the start.
	@$(BIN)/mypy & types=$$!; $(BIN)/pytest -n 2 --dist worksteal; tests=$$?; \
	  wait $$types && exit $$tests

pythons: develop texts ## What depends on Python: types, digests, texts of cores, messages, `check`
	@$(BIN)/mypy & types=$$!; $(BIN)/pytest -m 'pythons and not soak' -n 2 --dist worksteal; tests=$$?; \
	  wait $$types && exit $$tests
	$(BIN)/boresight check complementary,ekf_quaternion,ekf_bias,mekf boresight/sim/data --steps 200 -q

texts: develop         ## All that `compile` writes, schedules after a short search: in build/texts
	rm -rf "$(OUT)/texts"
	$(BIN)/python tests/bits/compile_all.py "$(OUT)/texts" --brief --every-core >/dev/null

# In environments of their own, made anew.
newest:                ## `make test` with the newest release of every dependency
	rm -rf $(VENV)-newest
	$(MAKE) test VENV=$(VENV)-newest LOCK=

oldest: $(VENV)/.lock  ## All tests with the oldest that pyproject.toml allows, on the oldest Python
	rm -rf $(VENV)-oldest
	$(UV) --extra test --python $(BIN)/python --resolution lowest-direct -o $(VENV)-oldest.txt
	$(MAKE) develop VENV=$(VENV)-oldest LOCK=$(VENV)-oldest.txt BUILD=
	@# Without types: those of old libraries say less.
	$(VENV)-oldest/bin/pytest -n 2 --dist worksteal

HOURS := 2
soak: develop          ## Search for trouble for HOURS hours, and on: build/soak/soak.html; then long campaigns
	$(BIN)/python -m tests.support.soak --hours $(HOURS)
	$(BIN)/python -m boresight.sim.formal
	$(BIN)/boresight bench
	$(BIN)/boresight simulate --faults

lint: develop          ## ruff: rules and format
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: develop         ## mypy
	$(BIN)/mypy

bench: setup           ## Rates of the models, as ratios in one run
	$(BIN)/boresight bench

formal: develop        ## Prove what docs/proofs.md claims
	$(BIN)/python -m boresight.sim.formal

firmware: setup cross  ## C on a simulated soft core: cycles, sizes, equality
	$(BIN)/python -m boresight.sim.attitude.soc -o $(OUT)/firmware.json

docs: $(VENV)/.docs    ## The site, build/site/index.html (warnings are errors), and the page of commands
	$(BIN)/python docs/site/commands.py
	$(BIN)/python -m sphinx -q -W --keep-going -b html -c docs/site docs $(OUT)/site
	@echo "$(OUT)/site/index.html"

dist: $(VENV)/.release ## Wheel and source archive, and what checks them
	rm -rf $(OUT)/dist
	$(BIN)/python -m build -q --outdir $(OUT)/dist
	$(BIN)/twine check --strict $(OUT)/dist/*
	$(BIN)/pyroma -n 8 $(OUT)/dist/*.tar.gz

lock: $(VENV)/.lock    ## constraints.txt anew after pyproject.toml (LOCKFLAGS=--upgrade: all of it)
	$(UV) --all-extras --universal --python-version 3.11 --fork-strategy fewest -o constraints.txt $(LOCKFLAGS)

doctor: setup          ## Which tools are here, and what is missing
	$(BIN)/boresight doctor

setup: preflight-setup $(VENV)/.done tools      ## What running needs, in .venv

develop: preflight-tests $(VENV)/.test tools    ## What testing needs too

# What only the system can give, before anything is built or downloaded: one line for each.
preflight-setup preflight-run preflight-tests:
	@command -v "$(PYTHON)" >/dev/null || { echo "error: $(PYTHON) not found: install Python 3.11 or newer (Debian, Ubuntu: sudo apt-get install python3 python3-venv)" >&2; exit 2; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "error: $(PYTHON) is older than 3.11: install Python 3.11 or newer, or name one: make PYTHON=python3.12" >&2; exit 2; }
	@"$(PYTHON)" -I model/tools/needs.py $(@:preflight-%=%) $(VENV)

# One environment in the checkout; made again when the dependencies change.
$(VENV)/.done: pyproject.toml $(LOCK) | preflight-setup
	@"$(PYTHON)" -m venv $(VENV)
	@# Python compiles what is used when it is used: half of the time to install.
	$(PIP) --no-compile --editable .
	@# Relative, so plain ASCII: with LC_ALL=C Python would not start on a path beyond it.
	@for f in $(VENV)/lib/python*/site-packages/__editable__.boresight-*.pth; do echo ../../../../.src > "$$f"; done
	@touch $@

# What only some targets need, in the same environment.
$(VENV)/.test: | preflight-tests
$(VENV)/.test $(VENV)/.docs $(VENV)/.release $(VENV)/.lock: $(VENV)/.%: $(VENV)/.done
	@$(BIN)/python -c 'import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["$*"], sep="\n")' >$@.txt
	$(PIP) --no-compile --requirement $@.txt
	@touch $@

# Optional programs (cross: the compiler for the soft core): installed where root may, otherwise
# their lines.
tools: preflight-setup
	@"$(PYTHON)" -I model/tools/needs.py optional $(VENV)

cross: preflight-setup
	@"$(PYTHON)" -I model/tools/needs.py cross $(VENV)

clean:                 ## Remove what make made
	rm -rf "$(OUT)" $(VENV) $(VENV)-* .pytest_cache .mypy_cache .ruff_cache *.egg-info .src/*.egg-info

help:                  ## This list
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 12
