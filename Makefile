# `make benchmark` is the main job, `make test` checks everything, `make test-adapters` what needs BenchMARL or RLlib.
# They set up .venv* themselves; they need Python 3.11 or later and the package registries. Another interpreter:
# make benchmark PYTHON=python3.12
PYTHON ?= python3
BIN := .venv/bin

.DELETE_ON_ERROR:
.PHONY: help benchmark test test-adapters test-benchmarl test-rllib check clean

help:
	@echo "make benchmark [ARGS='--seeds 5']   the paper's comparison: table, results and pictures"
	@echo "make test      [ARGS='-k sonar']    checks and tests"
	@echo "make test-adapters                  tests of BenchMARL and RLlib, each in an environment of its own"
	@echo "make check                          ruff, pyright and import-linter only"
	@echo "make clean                          remove .venv, .venv-benchmarl and .venv-rllib"

benchmark: .venv/base.stamp
	$(BIN)/uuv-marl benchmark $(ARGS)

test: check
	$(BIN)/python -m pytest $(ARGS)

test-adapters: test-benchmarl test-rllib

test-benchmarl: .venv-benchmarl/benchmarl.stamp
test-rllib: .venv-rllib/rllib.stamp
test-benchmarl test-rllib: test-%:
	.venv-$*/bin/python -m pytest tests/adapters/test_$*.py $(ARGS)

check: .venv/dev.stamp
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/pyright

# A stamp without its environment is worth nothing.
STAMPS := .venv/base.stamp .venv/dev.stamp .venv-benchmarl/benchmarl.stamp .venv-rllib/rllib.stamp
.PHONY: $(foreach stamp,$(STAMPS),$(if $(wildcard $(dir $(stamp))bin/uuv-marl),,$(stamp)))

$(STAMPS): pyproject.toml constraints.txt constraints-benchmarl.txt constraints-rllib.txt tools/setup_venv.py
	@command -v "$(PYTHON)" >/dev/null || { echo "There is no '$(PYTHON)' here. Install Python 3.11 or later, or name one: make $(MAKECMDGOALS) PYTHON=/path/to/python3"; exit 1; }
	@"$(PYTHON)" tools/setup_venv.py $(basename $(notdir $@))

clean:
	rm -rf .venv .venv-benchmarl .venv-rllib
