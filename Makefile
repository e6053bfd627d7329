# Boresight. `make` sets up and runs the main job; `make test` sets up and runs the tests.
# `make help` lists the rest.

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
OUT    ?= build
# Its warnings are about caches in a closed home and about editable installs as such.
PIP    := PYTHONWARNINGS=ignore $(BIN)/python -m pip install -qq --disable-pip-version-check
SEED   ?= 1
COUNT  ?= 40
JOBS   ?= 2

.DEFAULT_GOAL := main
.PHONY: main test soak lint types setup tools bench formal mutants firmware docs dist cross doctor clean help

main: setup            ## Set up, then Verilog, proof on recorded data, area, clock, report
	$(BIN)/boresight doctor --quiet
	$(BIN)/boresight demo -o $(OUT)

# Python starts hundreds of times: compiled modules are kept, whatever the environment says.
main test soak: export PYTHONDONTWRITEBYTECODE :=

test: setup            ## Set up, then lint, types and all tests
	$(BIN)/boresight doctor --quiet
	$(BIN)/ruff check .
	$(BIN)/ruff format --check --quiet .
	@# Types are checked beside the tests: both cores are busy from the start.
	@$(BIN)/mypy & types=$$!; $(BIN)/pytest -n 2 --dist worksteal; tests=$$?; \
	  wait $$types && exit $$tests

soak: setup            ## Long campaigns, of which `make test` runs a short form (README: cost)
	$(BIN)/pytest -m 'soak or hypothesis' --hypothesis-profile=soak -n 2 --dist worksteal
	$(BIN)/python -m boresight.sim.formal
	$(BIN)/boresight bench
	$(BIN)/boresight covariance
	$(BIN)/boresight simulate --faults

lint: setup            ## ruff: rules and format
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: setup           ## mypy
	$(BIN)/mypy

bench: setup           ## Rates of the models, as ratios in one run
	$(BIN)/boresight bench

formal: setup          ## Prove what docs/proofs.md claims
	$(BIN)/python -m boresight.sim.formal

mutants: setup         ## Faults put into the code: which ones no test notices (SEED, COUNT, JOBS)
	nice -n 15 $(BIN)/python -m tests.mutants --seed $(SEED) --count $(COUNT) --jobs $(JOBS) -o $(OUT)/mutants

firmware: setup cross  ## C on a simulated soft core: cycles, sizes, equality
	$(BIN)/python -m boresight.sim.soc --board -o $(OUT)/firmware

docs: $(VENV)/.docs    ## The site, build/site/index.html; warnings are errors
	$(BIN)/python -m sphinx -q -W --keep-going -b html -c docs/site docs $(OUT)/site
	@echo "$(OUT)/site/index.html"

dist: $(VENV)/.release ## Wheel and source archive, and what checks them
	rm -rf $(OUT)/dist
	$(BIN)/python -m build -q --outdir $(OUT)/dist
	$(BIN)/twine check --strict $(OUT)/dist/*
	$(BIN)/pyroma -n 8 $(OUT)/dist/*.tar.gz

doctor: setup          ## Which tools are here, and what is missing
	$(BIN)/boresight doctor

setup: $(VENV)/.done tools

# One environment in the checkout; made again when the dependencies change.
$(VENV)/.done: pyproject.toml
	@command -v $(PYTHON) >/dev/null || { echo "error: $(PYTHON) not found: install Python 3.11 or newer" >&2; exit 2; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "error: $(PYTHON) is older than 3.11: install Python 3.11 or newer, or say make PYTHON=..." >&2; exit 2; }
	@$(PYTHON) -m venv $(VENV) || { echo "error: python3 -m venv failed: install python3-venv" >&2; exit 2; }
	@# Python compiles what is used when it is used: half of the time to install.
	$(PIP) --no-compile --editable '.[test]'
	@# Relative, so plain ASCII: with LC_ALL=C Python would not start on a path beyond it.
	@for f in $(VENV)/lib/python*/site-packages/__editable__.boresight-*.pth; do echo ../../../../.src > "$$f"; done
	@touch $@

# What only one target needs, in the same environment.
$(VENV)/.docs $(VENV)/.release: $(VENV)/.%: $(VENV)/.done
	$(PIP) $$($(BIN)/python -c 'import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["$*"])')
	@touch $@

CROSS := gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf

# Icarus is a second simulator: installed where we may, asked for where not.
tools: $(VENV)/.done
	@for t in gcc g++ make perl; do command -v $$t >/dev/null || { echo "error: $$t not found: install it (Debian: apt-get install build-essential perl)" >&2; exit 2; }; done
	@command -v iverilog >/dev/null || { \
	  if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	    echo "installing Icarus Verilog"; \
	    { apt-get install -y -qq iverilog || { apt-get update -qq && apt-get install -y -qq iverilog; }; } >/dev/null 2>&1 || \
	      echo "note: Icarus Verilog could not be installed; Verilator alone is used (apt-get install iverilog adds the second simulator)"; \
	  else echo "note: for the second simulator: sudo apt-get install iverilog"; fi; }
	@command -v riscv64-unknown-elf-gcc >/dev/null || { \
	  if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	    $(MAKE) --no-print-directory cross || \
	      echo "note: without that compiler the tests of the soft core's firmware are skipped, and say so"; \
	  else echo "note: for the tests of the soft core's firmware: sudo apt-get install $(CROSS)"; fi; }

# The compiler for the soft core: installed where we may, asked for where not.
cross:
	@command -v riscv64-unknown-elf-gcc >/dev/null && test -e "$$(riscv64-unknown-elf-gcc -print-file-name=picolibc.specs)" || { \
	  if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	    echo "installing $(CROSS)"; \
	    { apt-get install -y -qq $(CROSS) || { apt-get update -qq && apt-get install -y -qq $(CROSS); }; } >/dev/null 2>&1 || \
	      { echo "error: $(CROSS) could not be installed: install them (Debian: apt-get install $(CROSS))" >&2; exit 2; }; \
	  else echo "error: no compiler for the soft core: sudo apt-get install $(CROSS)" >&2; exit 2; fi; }

clean:                 ## Remove what make made; results that somebody changed stay
	rm -rf "$(OUT)/site" "$(OUT)/dist"
	$(PYTHON) -m boresight.disk.clear "$(OUT)"
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache *.egg-info .src/*.egg-info

help:                  ## This list
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 12
