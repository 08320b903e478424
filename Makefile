# Everything runs in .venv, which `make` fills and refills when pyproject.toml or constraints.txt changes.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALL := $(BIN)/python -m pip install -q --disable-pip-version-check -c constraints.txt -e

.PHONY: help demo test test-extras lint docs bench clean
.NOTPARALLEL: # two pips in one environment get in each other's way

help: ## list what make can do
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' $(MAKEFILE_LIST) | expand -t 20

demo: $(VENV)/.demo ## show what supremal does, in a minute
	$(BIN)/supremal demo

test: lint ## lint, then all tests: kernels compiled, then uncompiled
	$(BIN)/pytest -q -n 2
	NUMBA_DISABLE_JIT=1 $(BIN)/pytest -q -n 2 -m engine tests

test-extras: $(VENV)-deep/.done $(VENV)-ray/.done ## the tests of the heavy extras, each in an environment of its own
	$(VENV)-deep/bin/pytest -q -n 2 tests/extras/deep tests/extras/multi tests/extras/video src/supremal/deep src/supremal/envs
	$(VENV)-ray/bin/pytest -q tests/extras/ray tests/extras/rllib tests/test_supervised_env.py tests/test_supervised_vector.py

lint: $(VENV)/.test ## style, types, and which room imports which
	$(BIN)/ruff check -q
	$(BIN)/ruff format -q --check
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo

docs: $(VENV)/.docs ## the pages and the reference as a site, in build/docs
	$(BIN)/sphinx-build -q -W --keep-going -b html -d build/doctrees docs build/docs

bench: $(VENV)/.bench ## time what the documentation gives times for
	$(BIN)/python -m benchmarks

clean: ## remove .venv and all that was built or cached
	rm -rf $(VENV) $(VENV)-deep $(VENV)-ray build dist .*_cache .hypothesis
	find . -name __pycache__ -prune -exec rm -rf {} +

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "supremal needs Python 3.11 or newer; name one: make PYTHON=python3.12 ..." >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.demo: pyproject.toml constraints.txt | $(BIN)/python
	$(INSTALL) '.[plot]'
	@touch $@

$(VENV)/.bench: pyproject.toml constraints.txt | $(BIN)/python
	$(INSTALL) '.[bench]'
	@touch $@

$(VENV)/.test: pyproject.toml constraints.txt | $(BIN)/python
	$(INSTALL) '.[test,lint]'
	@touch $@

$(VENV)/.docs: pyproject.toml constraints.txt | $(BIN)/python
	$(INSTALL) '.[docs]'
	@touch $@

# RLlib pins an older Gymnasium, so what Ray brings has an environment and releases of its own.
$(VENV)-deep/.done: EXTRAS := test,deep,multi,video
$(VENV)-deep/.done: PINS := constraints.txt
$(VENV)-ray/.done: EXTRAS := test,rllib
$(VENV)-ray/.done: PINS := constraints-ray.txt

$(VENV)-%/.done: pyproject.toml constraints.txt constraints-ray.txt | $(BIN)/python
	$(PYTHON) -m venv $(VENV)-$*
	$(VENV)-$*/bin/python -m pip install -q --disable-pip-version-check -c $(PINS) torch
	$(VENV)-$*/bin/python -m pip install -q --disable-pip-version-check -c $(PINS) -e '.[$(EXTRAS)]'
	@touch $@
