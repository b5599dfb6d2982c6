# Fuzzing: tests/fuzz/<target>.c, one program each, linked with the core and the robot in small sizes
# (tests/fuzz/sizes.h). clang's libFuzzer makes inputs up (`make fuzz`); `make test` replays those that are
# kept in tests/fuzz/corpus/<target>.bin, compiled with the compiler of the other tests.

FUZZ_TARGETS := link map model scanner image api drive session
FUZZ_HELPERS := tests/fuzz/input.c tests/fuzz/fuzz.c tests/fuzz/picture.c tests/soak/definite.c
FUZZ_ROBOT := $(ROBOT_SOURCES)
FUZZ_LIBRARY := $(CORE_SOURCES) $(FUZZ_ROBOT) $(FUZZ_HELPERS)
FUZZ_DEFINES := -Itests/fuzz -Itests/unit -Itests/soak -DBSLAM_CONFIG_HEADER='"sizes.h"' -DROBOT_VISION=1 \
    -DBSLAM_APPEARANCE=1 -DBSLAM_SMOOTHER=1 -DBSLAM_GUARD=2 -DSESSION_MAP_BYTES=4096
FUZZ_FLAGS := $(C_STANDARD) $(C_INCLUDES) $(FUZZ_DEFINES) $(SANITIZE) -g -MMD -MP

CLANG := clang-19
# Stack frames that are kept after their return cost half of the speed.
FUZZ_COMPILE_fuzz := $(CLANG) $(FUZZ_FLAGS) -O2 -fsanitize-address-use-after-return=never \
    -fsanitize-coverage=inline-8bit-counters,pc-table
FUZZ_COMPILE_replay := $(CC) $(FUZZ_FLAGS) $(UNIT_WARNINGS)
FUZZ_LINK_fuzz := $(CLANG) $(SANITIZE) -fsanitize=fuzzer
FUZZ_LINK_replay := $(CC) $(SANITIZE)
FUZZ_MAIN_replay := build/replay/tests/fuzz/replay.o

# The rules for one way of building them: $(1) is fuzz or replay. An archive, so that a target has no more in
# it than it calls: libFuzzer looks over all of a program after each input.
define fuzz_rules
build/$(1)/%.o: %.c mk/config.mk mk/fuzz.mk
	@mkdir -p $$(@D)
	@$$(FUZZ_COMPILE_$(1)) -c $$< -o $$@

build/$(1)/library.a: $$(FUZZ_LIBRARY:%.c=build/$(1)/%.o)
	@rm -f $$@ && ar rcs $$@ $$^

$$(FUZZ_TARGETS:%=build/$(1)/%): build/$(1)/%: build/$(1)/tests/fuzz/%.o $$(FUZZ_MAIN_$(1)) \
    build/$(1)/library.a
	@$$(FUZZ_LINK_$(1)) $$^ -lm -o $$@

-include $$(FUZZ_LIBRARY:%.c=build/$(1)/%.d) $$(FUZZ_TARGETS:%=build/$(1)/tests/fuzz/%.d)
endef
$(foreach way,fuzz replay,$(eval $(call fuzz_rules,$(way))))

.PHONY: replay
replay: $(FUZZ_TARGETS:%=build/replay/%) ## the inputs that fuzzing kept, once each
	@for target in $(FUZZ_TARGETS); do printf 'replay %s: ' $$target; \
	    build/replay/$$target tests/fuzz/corpus/$$target.bin || exit 1; done

# What more inputs are made up: until the goals are met, or so long (FUZZ="--seconds 60 --targets map api").
FUZZ :=

.PHONY: fuzz-programs fuzz
fuzz-programs:
	@tools/setup.sh proof
	@$(MAKE) --no-print-directory --silent $(FUZZ_TARGETS:%=build/fuzz/%)
	@$(PYTHON) -m tools.proofs.fuzz --built

fuzz: fuzz-programs ## make inputs up for every target until the goals are met, on top of out/fuzz (20 min)
	@$(PYTHON) -m tools.proofs.fuzz $(FUZZ)

# By seeds in place of inputs, with the library's own sizes, for hundreds of calls: tests/fuzz/adversary.c.
ADVERSARY_SOURCES := $(addprefix tests/fuzz/,adversary.c fuzz.c input.c) tests/soak/definite.c
ADVERSARY_SEEDS := 3000
ADVERSARY_STEPS := 400

build/adversary: $(ADVERSARY_SOURCES) tests/fuzz/fuzz.h build/unit/float/libbslam.a
	@$(UNIT_COMPILE_float) $(UNIT_WARNINGS) -Itests/fuzz -Itests/unit -Itests/soak $(ADVERSARY_SOURCES) \
	    build/unit/float/libbslam.a -lm -o $@

.PHONY: adversary adversary-short
adversary: build/adversary ## odd but legal settings and calls, a world behind them: 3 x 3000 seeds (10 min)
	@for profile in 0 1 2; do $< $$profile 0 $(ADVERSARY_SEEDS) $(ADVERSARY_STEPS) || exit 1; done

adversary-short:
	@$(MAKE) --no-print-directory adversary ADVERSARY_SEEDS=5
