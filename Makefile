# `make benchmark` is the main job, `make test` checks everything. Both set up .venv themselves; they need Python 3.11
# or later and the package registries. Another interpreter: make benchmark PYTHON=python3.12
PYTHON ?= python3
BIN := .venv/bin

.DELETE_ON_ERROR:
.PHONY: help benchmark test check clean

help:
	@echo "make benchmark [ARGS='--seeds 5']   the paper's comparison: table, results and pictures"
	@echo "make test      [ARGS='-k sonar']    checks and tests"
	@echo "make check                          ruff, pyright and import-linter only"
	@echo "make clean                          remove .venv"

benchmark: .venv/base.stamp
	$(BIN)/uuv-marl benchmark $(ARGS)

test: check
	$(BIN)/python -m pytest $(ARGS)

check: .venv/dev.stamp
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/pyright

# A stamp without its environment is worth nothing.
ifeq ($(wildcard $(BIN)/uuv-marl),)
.PHONY: .venv/base.stamp .venv/dev.stamp
endif

.venv/base.stamp .venv/dev.stamp: .venv/%.stamp: pyproject.toml constraints.txt tools/setup_venv.py
	@command -v "$(PYTHON)" >/dev/null || { echo "There is no '$(PYTHON)' here. Install Python 3.11 or later, or name one: make $(MAKECMDGOALS) PYTHON=/path/to/python3"; exit 1; }
	@"$(PYTHON)" tools/setup_venv.py $*

clean:
	rm -rf .venv
