# `make benchmark` and `make reproduce` are the main jobs, `make test` checks everything, `make test-adapters` what needs BenchMARL or RLlib.
# They set up .venv* themselves; they need Python 3.11 or later and the package registries. Another interpreter:
# make benchmark PYTHON=python3.12
PYTHON ?= python3
BIN := .venv/bin
PYTEST := -m pytest --durations=15
# Two processes; a file's tests stay together, since they share what is costly to make.
HALVES := -n 2 --dist loadfile

.DELETE_ON_ERROR:
.PHONY: help benchmark reproduce test tests docs-check test-bounds test-lowest test-newest test-light test-adapters test-benchmarl
.PHONY: test-rllib docs notebooks test-docs docs-links check size dist test-release test-attacks perf perf-training clean

help:
	@echo "make benchmark [ARGS='--seeds 5']   the paper's comparison: table, results and pictures"
	@echo "make reproduce [ARGS='--seeds 5']   the paper's figures, numbers and a ledger: about ten minutes"
	@echo "make test      [ARGS='-k sonar']    checks and tests"
	@echo "make docs-check                     pages, tables and pictures are those of the code and of the shipped data"
	@echo "make docs                           the site of these pages and of the code: build/site/index.html"
	@echo "make notebooks [ARGS=1-first-steps] runs the tutorials and writes them as notebooks: docs/tutorials/*.ipynb"
	@echo "make test-docs                      the site without a warning, its links, search and width; tutorials run"
	@echo "make docs-links                     the site's links to other sites, which need the internet"
	@echo "make test-bounds                    the simulation's tests, every index of compiled code checked"
	@echo "make test-attacks                   hostile inputs, kills and crash points: SECURITY.md"
	@echo "make test-release                   a wheel, installed into an empty environment, and its commands there"
	@echo "make test-lowest                    tests with the oldest libraries that pyproject.toml allows, without torch"
	@echo "make test-newest PYTHON=python3.14  tests with today's newest libraries, without torch"
	@echo "make test-light PYTHON=python3.13   tests without torch, on another Python"
	@echo "make test-adapters                  tests of BenchMARL and RLlib, each in an environment of its own"
	@echo "make check                          ruff, pyright and import-linter only"
	@echo "make dist                           source distribution and wheel in dist/"
	@echo "make perf      [ARGS='--only vmas'] rates beside MPE2, VMAS, JaxMARL and CAMAR: docs/speed.md"
	@echo "make perf-training                  training beside SuperSuit and RLlib: docs/speed.md"
	@echo "make versions OTHER=path            is another checkout the same, bit for bit, and as fast?"
	@echo "make size                           lines, words, megabytes, commands and options of this repository"
	@echo "make clean                          remove .venv and .venv-*"

benchmark: .venv/base.stamp
	$(BIN)/uuv-marl benchmark $(ARGS)

reproduce: .venv/base.stamp
	$(BIN)/python -m research.paper $(ARGS)

test: check tests

tests: .venv/dev.stamp
	$(BIN)/python $(PYTEST) $(HALVES) -m "not docs and not release" $(ARGS)

docs-check: .venv/dev.stamp
	$(BIN)/python $(PYTEST) $(HALVES) -m docs $(ARGS)

SITE := .venv-docs/bin/python docs/site/build.py

docs: .venv-docs/docs.stamp
	$(SITE) $(ARGS)

notebooks: .venv-docs/docs.stamp
	.venv-docs/bin/python docs/site/notebooks.py $(ARGS)

# From nothing, because Sphinx warns of a page only when it reads it.
test-docs: .venv-docs/docs.stamp
	rm -rf build/site build/site-source build/site-doctrees
	$(SITE) -W --keep-going
	.venv-docs/bin/python $(PYTEST) tests/site $(ARGS)

docs-links: .venv-docs/docs.stamp
	$(SITE) -b linkcheck $(ARGS)

# Little optimised, which compiles faster and moves no bit; what is compiled so stays out of the user's cache.
BOUNDED := baselines bounds env few_informed hard_water nearby oracle reward disturbances disturbances_modem disturbances_sonar silent_targets sonar stopping swarm tasks traffic trajectory two_swarms vector_env vehicle
test-bounds: .venv/dev.stamp
	NUMBA_BOUNDSCHECK=1 NUMBA_OPT=1 NUMBA_NUM_THREADS=1 UUV_MARL_CACHE_DIR=$(CURDIR)/.venv/bounds \
	$(BIN)/python $(PYTEST) $(HALVES) $(BOUNDED:%=tests/test_%.py) $(ARGS)

test-release: .venv/dev.stamp
	$(BIN)/python $(PYTEST) -m release tests/test_release.py $(ARGS)

test-attacks: .venv/dev.stamp
	$(BIN)/python -m tests.attacks $(ARGS)

test-adapters: test-benchmarl test-rllib

test-lowest: .venv-lowest/lowest.stamp
test-newest: .venv-newest/newest.stamp
test-light: .venv-light/light.stamp
# What is old is deprecated by newer libraries beneath it.
test-lowest: PYTEST += -W default::DeprecationWarning
test-lowest test-newest test-light: test-%:
	.venv-$*/bin/python $(PYTEST) $(HALVES) -m "not docs and not release" $(ARGS)

test-benchmarl: .venv-benchmarl/benchmarl.stamp
test-rllib: .venv-rllib/rllib.stamp
test-benchmarl: ALSO = tests/adapters/test_learners.py
test-benchmarl test-rllib: test-%:
	.venv-$*/bin/python $(PYTEST) tests/adapters/test_$*.py $(ALSO) $(ARGS)

check: .venv/dev.stamp
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/pyright

size: .venv/base.stamp
	@$(BIN)/python tools/size.py

dist: .venv/dev.stamp
	$(BIN)/python -m build

PEERS := perf-mpe2 perf-vmas perf-jaxmarl perf-camar

perf: .venv/dev.stamp $(foreach name,$(PEERS),.venv-$(name)/$(name).stamp)
	$(BIN)/python perf/compare.py $(ARGS)

perf-training: .venv/dev.stamp .venv-perf-supersuit/perf-supersuit.stamp .venv-rllib/rllib.stamp
	$(BIN)/python perf/compare.py --training $(ARGS)

.PHONY: versions
versions: .venv/dev.stamp
	$(BIN)/python perf/versions.py $(OTHER) $(ARGS)

ENVIRONMENTS := docs light lowest newest benchmarl rllib perf-supersuit $(PEERS)
STAMPS := .venv/base.stamp .venv/dev.stamp $(foreach name,$(ENVIRONMENTS),.venv-$(name)/$(name).stamp)
$(STAMPS): pyproject.toml $(wildcard constraints*.txt) tools/setup_venv.py
	@command -v "$(PYTHON)" >/dev/null || { echo "There is no '$(PYTHON)' here. Install Python 3.11 or later, or name one: make $(MAKECMDGOALS) PYTHON=/path/to/python3"; exit 1; }
	@"$(PYTHON)" tools/setup_venv.py $(basename $(notdir $@))

clean:
	rm -rf .venv $(ENVIRONMENTS:%=.venv-%)
