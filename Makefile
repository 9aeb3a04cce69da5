PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
DEMO := $(VENV)/.plots,tables
READY := $(VENV)/.dev
export MPLBACKEND := Agg

.PHONY: demo test test-thorough test-slow lint pytest bench docs site clean

demo: $(DEMO)  ## set up and run the studies of the clutch actuators
	$(BIN)/python -m studies validate --out output
	$(BIN)/python -m studies optimise --out output

test: $(READY)  ## set up and run lint, type check and tests
	$(MAKE) --jobs=2 lint pytest

pytest: $(READY)
	$(BIN)/python -m pytest

test-thorough: $(READY)  ## the tests that compile large or many programs
	$(BIN)/python -m pytest -m "thorough and not slow"

test-slow: $(READY)  ## the tests of whole studies
	$(BIN)/python -m pytest -m slow

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/basedpyright

bench: $(READY)  ## measure; see benchmarks/
	$(BIN)/python -m benchmarks --json output/benchmarks.json --out output

docs: $(READY)  ## regenerate the pages with computed results
	$(BIN)/python -m docs

site: $(READY)  ## build the documentation site in site/; fails on a dead link
	$(BIN)/python -m docs.site

$(VENV)/.%: pyproject.toml  # the environment with these extras
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --editable ".[$*]"
	touch $@

clean:
	rm -rf $(VENV) output build/pages site .cache
