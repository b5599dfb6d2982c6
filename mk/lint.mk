# Style, layers, namespaces and complexity. Every check reads; only `make format` writes.

C_TEST_FILES := $(wildcard tools/bench/*.c tests/unit/*.[ch] tests/unit/*/*.[ch] tests/unit/*/*/*.[ch] \
    tests/unit/*/*/*/*.[ch] tests/bench/*.[ch] tests/bench/peers/*.[ch] tests/bench/peers/*.cpp \
    tests/fuzz/*.[ch] tests/sketches/*.c* tests/soak/*.[ch])
ROBOT_FILES := $(wildcard firmware/robot/*.[ch] firmware/robot/rtos/*.c firmware/bench/*.[ch] \
    firmware/port/*.[ch] firmware/port/*/*.[ch])
CAMERA_SOURCES := $(wildcard host_sim/bslam/world/camera/*.c)
CAMERA_HEADERS := $(wildcard host_sim/bslam/world/camera/*.h)
C_FILES := $(sort $(CORE_SOURCES) $(CORE_HEADERS) $(C_TEST_FILES) $(CAMERA_SOURCES) $(CAMERA_HEADERS) \
    $(ROBOT_FILES))
PYTHON_DIRS := $(wildcard setup.py host_sim tools tests/python)

LINTS := lint-columns lint-c-format lint-c-tidy lint-python lint-types lint-layers \
    lint-complexity lint-version lint-limits

.PHONY: lint $(LINTS)
lint: $(LINTS) library-m4f_whole ## formatting, static analysis, layers, symbols, complexity

# The files that no formatter watches; 110 columns is what the formatters allow.
lint-columns:
	@! LC_ALL=C.UTF-8 grep -HnoE '^.{110}.+' $(wildcard Makefile mk/*.mk tools/*.sh) $(C_FILES)

lint-c-format:
	@$(VENV)/bin/clang-format --dry-run -Werror $(C_FILES)

# clang-tidy is slow, so a file that passed is not looked at again until it, a header or the rules change. How
# far its analyzer follows a path is shallow here and deep in `make proof`, which takes seven times as long.
TIDY_MODE := shallow
TIDY_ANALYZER := $(patsubst %,--extra-arg=%,-Xclang -analyzer-config -Xclang mode=$(TIDY_MODE))
TIDY_STAMP := build/tidy/$(TIDY_MODE)/%.ok
TIDY_STAMPS := $(patsubst %.c,$(TIDY_STAMP),$(CORE_SOURCES) $(CAMERA_SOURCES))
lint-c-tidy: $(TIDY_STAMPS)

$(TIDY_STAMPS): $(TIDY_STAMP): %.c $(CORE_HEADERS) $(CAMERA_HEADERS) .clang-tidy mk/config.mk mk/lint.mk
	@mkdir -p $(@D)
	@$(VENV)/bin/clang-tidy --quiet $(TIDY_ANALYZER) $< -- $(C_STANDARD) $(C_INCLUDES) >$@.log 2>&1 \
	    || { cat $@.log >&2; exit 1; }
	@touch $@

lint-python:
	@$(PYTHON) -m ruff check --quiet --output-format=concise $(PYTHON_DIRS) notebooks
	@$(PYTHON) -m ruff format --check --quiet $(PYTHON_DIRS) notebooks

lint-types:
	@$(PYTHON) -m mypy --no-error-summary

# Of the unit tests' objects, in which everything that may be left out is in, and the robot's.
lint-layers: $(UNIT_CORE_float) $(HOST_ROBOT_OBJECTS)
	@$(PYTHON) -m tools.checks.check_layers --objects $^

lint-complexity:
	@$(PYTHON) -m tools.checks.check_complexity $(CORE_SOURCES) $(CORE_HEADERS) $(ROBOT_FILES) $(PYTHON_DIRS)

lint-version:
	@$(PYTHON) -m tools.checks.check_version

# A table of what the project is held to, beside what it is: tools/checks/limits.toml.
lint-limits:
	@$(PYTHON) -m tools.checks.check_limits

.PHONY: format
format: ## rewrite C and Python files in the house format
	$(VENV)/bin/clang-format -i $(C_FILES)
	$(PYTHON) -m ruff check --fix-only --quiet $(PYTHON_DIRS) notebooks
	$(PYTHON) -m ruff format $(PYTHON_DIRS) notebooks
