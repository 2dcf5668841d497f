# `make benchmark` and `make reproduce` are the main jobs, `make test` checks everything, `make test-adapters` what needs BenchMARL or RLlib.
# They set up .venv* themselves; they need Python 3.11 or later and the package registries. Another interpreter:
# make benchmark PYTHON=python3.12
PYTHON ?= python3
BIN := .venv/bin

.DELETE_ON_ERROR:
.PHONY: help benchmark reproduce paper test test-adapters test-benchmarl test-rllib check perf perf-training clean

help:
	@echo "make benchmark [ARGS='--seeds 5']   the paper's comparison: table, results and pictures"
	@echo "make reproduce [ARGS='--seeds 5']   the paper's figures, numbers and a ledger: about ten minutes"
	@echo "make paper                          the same, then the page in docs/paper from it"
	@echo "make test      [ARGS='-k sonar']    checks and tests"
	@echo "make test-adapters                  tests of BenchMARL and RLlib, each in an environment of its own"
	@echo "make check                          ruff, pyright and import-linter only"
	@echo "make perf      [ARGS='--only vmas'] rates beside MPE2, VMAS and JaxMARL, about 15 minutes: docs/speed.md"
	@echo "make perf-training                  training beside SuperSuit and RLlib, and its profile: perf/training.md"
	@echo "make versions OTHER=path            is another checkout the same, bit for bit, and as fast?"
	@echo "make clean                          remove .venv and .venv-*"

benchmark: .venv/base.stamp
	$(BIN)/uuv-marl benchmark $(ARGS)

reproduce: .venv/base.stamp
	$(BIN)/uuv-marl reproduce $(ARGS)

paper: reproduce
	$(BIN)/python tools/ship_paper.py results/reproduce

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

PEERS := mpe2 vmas jaxmarl
PEER_STAMPS := $(foreach peer,$(PEERS),.venv-perf-$(peer)/perf-$(peer).stamp)

perf: .venv/dev.stamp $(PEER_STAMPS)
	$(BIN)/python perf/compare.py $(ARGS)
	$(BIN)/python perf/report.py

perf-training: .venv/dev.stamp .venv-perf-supersuit/perf-supersuit.stamp .venv-rllib/rllib.stamp
	$(BIN)/python perf/compare.py --training $(ARGS)
	$(BIN)/python perf/report.py

.PHONY: versions
versions: .venv/dev.stamp
	$(BIN)/python perf/versions.py $(OTHER) $(ARGS)

# A stamp without its environment is worth nothing.
STAMPS := .venv/base.stamp .venv/dev.stamp .venv-benchmarl/benchmarl.stamp .venv-rllib/rllib.stamp .venv-perf-supersuit/perf-supersuit.stamp
.PHONY: $(foreach stamp,$(STAMPS),$(if $(wildcard $(dir $(stamp))bin/uuv-marl),,$(stamp)))
.PHONY: $(foreach stamp,$(PEER_STAMPS),$(if $(wildcard $(dir $(stamp))bin/python),,$(stamp)))

$(STAMPS): pyproject.toml constraints.txt constraints-benchmarl.txt constraints-rllib.txt constraints-perf-supersuit.txt tools/setup_venv.py
$(PEER_STAMPS): $(PEERS:%=constraints-perf-%.txt) tools/setup_venv.py
$(STAMPS) $(PEER_STAMPS):
	@command -v "$(PYTHON)" >/dev/null || { echo "There is no '$(PYTHON)' here. Install Python 3.11 or later, or name one: make $(MAKECMDGOALS) PYTHON=/path/to/python3"; exit 1; }
	@"$(PYTHON)" tools/setup_venv.py $(basename $(notdir $@))

clean:
	rm -rf .venv .venv-benchmarl .venv-rllib .venv-perf-supersuit $(PEERS:%=.venv-perf-%)
