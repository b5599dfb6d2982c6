# Every entry point. `make help` lists the targets from their `##` comments. Recipes of more than a few lines
# live in mk/: config.mk (flags), unit.mk (C tests), firmware.mk (the library for a core), images.mk (images
# for boards, sizes), rtos.mk (the robot on FreeRTOS), lint.mk (style), bench.mk (instruction counts), docs.mk
# (generated documents), package.mk (wheel, hashes), fuzz.mk, mcdc.mk, soak.mk and mutants.mk (longer proofs).

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
MAKEFLAGS += --no-builtin-rules

VENV := .venv
PYTHON := $(VENV)/bin/python
# For what needs no installed package: before `make setup`, the system's.
PLAIN_PYTHON := $(or $(wildcard $(PYTHON)),python3)
BSLAM := $(VENV)/bin/bslam

include mk/config.mk
include mk/unit.mk
include mk/firmware.mk
include mk/rtos.mk
include mk/lint.mk
include mk/bench.mk
include mk/docs.mk
include mk/playground.mk
include mk/site.mk
include mk/package.mk
include mk/fuzz.mk
include mk/mcdc.mk
include mk/soak.mk
include mk/mutants.mk
include mk/packages.mk
include mk/examples.mk

.PHONY: help
help: ## list the targets
	@sed -n 's/^\([a-z-]*\):[^#]*## \(.*\)/  make \1\t\2/p' Makefile mk/*.mk | expand -t 22

# --- Setting up ---------------------------------------------------------------------------------------------

.PHONY: setup setup-run
setup: ## install what is missing, make .venv, build the extension; quick when nothing is missing
	@tools/setup.sh test
	@$(MAKE) --silent extension

setup-run:
	@tools/setup.sh run
	@$(MAKE) --silent extension

EXTENSION_STAMP := build/extension.stamp
EXTENSION_BUILD := setup.py host_sim/bslam_build.py host_sim/bslam/core/builds.py

.PHONY: extension
extension: $(EXTENSION_STAMP)

# What is newer than its sources is left alone: the first time pip has built it (tools/setup.sh).
$(EXTENSION_STAMP): $(EXTENSION_BUILD) $(CORE_SOURCES) $(CORE_HEADERS) $(CAMERA_SOURCES) $(CAMERA_HEADERS) \
    $(wildcard firmware/models/*.h) $(VENV)/run.stamp
	@echo "setup: building what is older than its sources"
	@$(PYTHON) setup.py --quiet build_ext --inplace
	@mkdir -p $(@D) && touch $@

# --- The main job -------------------------------------------------------------------------------------------

# A real log of the MRCLAM collection, where it is at hand: `bslam replay` looks into the same directories.
RUN_LOG := MRCLAM_Dataset6
RUN_DATA := $(or $(BSLAM_DATA),$(wildcard ../shared/data))

OWN_THINGS := firmware/models/own_room.json

.PHONY: run
run: setup-run ## the main job: the paper's room, by sightings and by images, then a real log if at hand
ifeq ($(wildcard $(RUN_DATA)/mrclam/$(RUN_LOG)),)
	@echo "make run: no real log will be replayed: get the UTIAS Multi-Robot Cooperative Localization and" \
	    "Mapping data set from its authors and let BSLAM_DATA name the directory that holds mrclam/$(RUN_LOG)"
endif
	$(BSLAM) run paper_room --seeds 0:1 --out out/run
	$(BSLAM) run paper_room --seeds 0:1 --sensor camera --out out/run_camera
	@echo "make run: now five things of the room, by a detector that learned them from drawn pictures: it may" \
	    "map one false beacon, and the verdict then says FAILED by map"
	$(BSLAM) detect run paper_room --model $(OWN_THINGS) --out out/run_own_things
	$(BSLAM) run paper_room --seeds 0:1 --sensor camera --model $(OWN_THINGS) --sigma 0.05 \
	    --out out/run_own_things
ifneq ($(wildcard $(RUN_DATA)/mrclam/$(RUN_LOG)),)
	$(BSLAM) replay mrclam $(RUN_LOG) --robot 3 --out out/replay
endif

.PHONY: tables
tables: setup-run ## the tables of the paper, in our figures
	$(BSLAM) tables --association known --out out/tables

.PHONY: train
train: setup ## train the beacon detectors on rendered worlds, write firmware/models/beacons.h (50 min)
	$(PYTHON) -m tools.training.train_detector
	@$(MAKE) --silent extension

# --- Testing ------------------------------------------------------------------------------------------------

# Two halves of about the same length, one for each core, and the longest first: the rest goes beside them.
PYTEST_HALF := tests/python/runs tests/python/target tests/python/tools tests/python/packaging

.PHONY: test pytest pytest-half pytest-rest
test: setup ## lint, C unit tests (float, double; sanitizers), fuzz inputs, soak, firmware in QEMU, pytest
	@$(MAKE) --no-print-directory --keep-going --jobs=2 pytest lint unit replay soak-short adversary-short \
	    check-sizes || { echo "make test: FAILED, see above" >&2; exit 1; }
	@echo "make test: all passed (lint, C unit tests, fuzz inputs, short lives, firmware and its sizes, pytest)"

pytest: pytest-half pytest-rest ## the Python tests only

pytest-half: images
	@$(PYTHON) -m pytest --quiet $(PYTEST_HALF)

pytest-rest: images
	@$(PYTHON) -m pytest --quiet $(PYTEST_HALF:%=--ignore=%)

# What of it: PROOF="--only soak mcdc", PROOF="--quick".
PROOF :=

.PHONY: proof
proof: setup ## every long proof beside its goal, in a table (90 minutes; goes on if stopped); out/proof
	@$(MAKE) --no-print-directory lint-c-tidy TIDY_MODE=deep
	@$(PYTHON) -m tools.proofs.prove $(PROOF)

.PHONY: clean
clean: ## remove what was built; .venv and out/ stay
	rm -rf build
	find host_sim -name '*.so' -delete
