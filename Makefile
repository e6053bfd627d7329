# Boresight. `make` sets up and runs the main job; `make test` sets up and runs the tests.

PYTHON ?= python3
VENV   ?= .venv
OUT    ?= build
BIN    := $(VENV)/bin
# Versions that are installed; empty for the newest: make test LOCK= VENV=.venv-newest
LOCK   ?= constraints.txt
# What the main job and a user of this clone need.
EXTRAS := sim,plots,board,systems
# What the main job makes, on what.
FILTERS := complementary ekf_quaternion ekf_bias mekf
DATA   := boresight/sim/data
# Arguments of pytest: make test TESTS="-m soak tests/sim"
TESTS  ?=
# Its warnings are about caches in a closed home and about editable installs as such.
PIP    := PYTHONWARNINGS=ignore PIP_CONSTRAINT="$(LOCK)" PIP_BUILD_CONSTRAINT="$(LOCK)" \
          $(BIN)/python -m pip install -qq --disable-pip-version-check --no-compile

.DEFAULT_GOAL := main
.PHONY: main setup test lint formal docs dist clean help needs

main: setup            ## Set up, then Verilog, check on recorded data, area, clock, report
	@mkdir -p $(OUT) && $(BIN)/boresight info >$(OUT)/tools.txt || { tail -n 1 $(OUT)/tools.txt; exit 1; }
	$(BIN)/boresight compile $(FILTERS) --board mimas --synth -o $(OUT)/core
	$(BIN)/boresight check mekf $(DATA)/ximu_walk.csv --steps 400 -o $(OUT)/report
	$(BIN)/boresight run mekf board -o $(OUT)/board
	@echo "$(OUT)/core: Verilog, C and test bench of four filters, described in README.md there"
	@echo "Open $(OUT)/report/report.html and $(OUT)/board/board.html in a browser."
	@echo "Next: source $(BIN)/activate; boresight new my_filter (docs/learn/first.md)"

# Python starts hundreds of times: compiled modules are kept, whatever the environment says.
main test: export PYTHONDONTWRITEBYTECODE :=

setup: $(VENV)/.setup  ## The environment .venv with what `make` needs

test: $(VENV)/.test lint ## Set up, then lint, types and all tests
	@# Types are checked beside the tests.
	@$(BIN)/mypy & types=$$!; $(BIN)/pytest -n auto --dist worksteal $(TESTS); tests=$$?; \
	  wait $$types && exit $$tests

lint: $(VENV)/.test    ## Rules and format (ruff)
	$(BIN)/ruff check --quiet .
	$(BIN)/ruff format --check --quiet .

formal: $(VENV)/.test  ## Prove what docs/proofs.md claims
	$(BIN)/pytest -q tests/sim/formal -m "soak or not soak"

docs: $(VENV)/.docs    ## The site, build/site/index.html (warnings are errors), and the page of commands
	$(BIN)/python -c "from boresight.cli import app; from boresight.verbs import VERBS; print(app(*VERBS).generate_docs().replace('# boresight', '# Commands', 1))" >docs/reference/commands.md
	$(BIN)/python -m sphinx -q -W --keep-going -b html -c docs/site docs $(OUT)/site
	@echo "$(OUT)/site/index.html"

dist: $(VENV)/.release ## Wheel and source archive, and what checks them
	rm -rf $(OUT)/dist
	$(BIN)/python -m build -q --outdir $(OUT)/dist
	$(BIN)/twine check --strict $(OUT)/dist/*
	@found=$$($(BIN)/pyroma -n 8 $(OUT)/dist/*.tar.gz 2>&1) || { echo "$$found"; exit 1; }

clean:                 ## Remove what make made
	rm -rf "$(OUT)" $(VENV) $(VENV)-* .pytest_cache .mypy_cache .ruff_cache *.egg-info .src/*.egg-info

help:                  ## This list
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 12

# What only the system can give, before anything is built or downloaded: one line for each.
needs:
	@command -v "$(PYTHON)" >/dev/null || { echo "error: $(PYTHON) not found: install Python 3.11 or newer (Debian, Ubuntu: sudo apt-get install python3 python3-venv)" >&2; exit 2; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "error: $(PYTHON) is older than 3.11: install Python 3.11 or newer, or name one: make PYTHON=python3.12" >&2; exit 2; }
	@"$(PYTHON)" -I model/tools/needs.py

# One environment in the checkout; made again when the dependencies change.
$(VENV)/.setup: pyproject.toml $(LOCK) | needs
	@"$(PYTHON)" -m venv $(VENV)
	$(PIP) --editable '.[$(EXTRAS)]'
	@$(BIN)/python -m pip uninstall -qqy setuptools  # 10 MB that Python 3.11 brings
	@# A plain folder, for mypy and editors; relative, so ASCII: with LC_ALL=C Python would not start on a path beyond it.
	@# Checkouts without symbolic links keep the hook of setuptools.
	@test ! -d .src/boresight || for f in $(VENV)/lib/python*/site-packages/__editable__.boresight-*.pth; do \
	  echo ../../../../.src > "$$f"; done
	@touch $@

# What only some goals need, in the same environment.
$(VENV)/.test $(VENV)/.docs $(VENV)/.release: $(VENV)/.%: $(VENV)/.setup
	@$(BIN)/python -c 'import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["$*"], sep="\n")' >$@.txt
	$(PIP) --requirement $@.txt
	@touch $@
