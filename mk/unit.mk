# C unit tests: tests/unit/<path>/test_<module>.c mirrors firmware/<path>/<module>.c. Each is a CMocka program
# linked with its own library and no other, built under sanitizers twice: float (the target) and double.

UNIT_SOURCES := $(sort $(wildcard $(addsuffix /test_*.c,tests/unit/* tests/unit/*/* tests/unit/*/*/*)))
# The library of a test, by its first folder; what a test of all of them links.
UNIT_LIBRARY_base := bslam
UNIT_LIBRARY_port := bslam
UNIT_LIBRARY_robot := robot bslam vision link
unit_library = $(or $(UNIT_LIBRARY_$(1)),$(1))

# Helpers that several tests share (tests/unit/*.c); linked to every test.
UNIT_HELPERS := $(sort $(wildcard tests/unit/*.c))

SANITIZE := -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all -fno-omit-frame-pointer

# A test may compare in double, and need not look at CMocka's `state`.
UNIT_WARNINGS := $(C_WARNINGS) -Wno-unused-parameter

UNIT_REALS := float double
# Everything that may be left out is in.
UNIT_SWITCHES := -DBSLAM_APPEARANCE=1 -DBSLAM_SMOOTHER=1 -DBSLAM_GUARD=2 -DBSLAM_HYPOTHESES_MAX=4
UNIT_FLAGS_float := -DBSLAM_REAL_DOUBLE=0 $(UNIT_SWITCHES)
UNIT_FLAGS_double := -DBSLAM_REAL_DOUBLE=1 $(UNIT_SWITCHES)
UNIT_CORE_WARNINGS_float := $(C_WARNINGS) $(C_WARNINGS_FLOAT)
UNIT_CORE_WARNINGS_double := $(C_WARNINGS)
UNIT_SANITIZE_float := $(SANITIZE)
UNIT_SANITIZE_double := $(SANITIZE)

# The float build as fast as it goes, for programs that run the tests often: mk/mutants.mk.
UNIT_FLAGS_plain := $(UNIT_FLAGS_float)
UNIT_CORE_WARNINGS_plain := $(UNIT_CORE_WARNINGS_float)

.PHONY: unit
unit: $(UNIT_REALS:%=unit-%) ## the C unit tests, in float and in double, under ASan and UBSan
	@test -n "$(UNIT_SOURCES)" || { echo "unit: no test found, tests/unit/*/test_*.c" >&2; exit 1; }

# The rules for one scalar type: $(1) is float or double.
define unit_rules
UNIT_DIR_$(1) := build/unit/$(1)
UNIT_COMPILE_$(1) = $$(CC) $$(C_STANDARD) $$(C_INCLUDES) $$(UNIT_FLAGS_$(1)) -O1 -g $$(UNIT_SANITIZE_$(1)) \
    -MMD -MP

UNIT_CORE_$(1) := $$(CORE_SOURCES:%.c=build/unit/$(1)/%.o)
UNIT_ARCHIVES_$(1) := $$(LIBRARIES:%=build/unit/$(1)/lib%.a)
UNIT_ROBOT_$(1) := $$(ROBOT_SOURCES:%.c=build/unit/$(1)/%.o)
UNIT_PROGRAMS_$(1) := $$(UNIT_SOURCES:tests/unit/%.c=build/unit/$(1)/bin/%)

.PHONY: unit-$(1)
unit-$(1): $$(UNIT_PROGRAMS_$(1):%=%.run)

$$(UNIT_CORE_$(1)): build/unit/$(1)/%.o: %.c mk/config.mk mk/unit.mk
	@mkdir -p $$(@D)
	@$$(UNIT_COMPILE_$(1)) $$(UNIT_CORE_WARNINGS_$(1)) -c $$< -o $$@

build/unit/$(1)/tests/%.o: tests/%.c mk/config.mk mk/unit.mk
	@mkdir -p $$(@D)
	@$$(UNIT_COMPILE_$(1)) $$(UNIT_WARNINGS) -Itests/unit $$(CMOCKA_CFLAGS) -c $$< -o $$@

# Flat archives: of two files of one name in a library one would be missing, and nothing would link.
build/unit/$(1)/helpers.a: $$(UNIT_HELPERS:%.c=build/unit/$(1)/%.o)
	@rm -f $$@ && ar rcs $$@ $$^

$$(UNIT_ROBOT_$(1)): build/unit/$(1)/%.o: %.c mk/config.mk mk/unit.mk mk/images.mk
	@mkdir -p $$(@D)
	@$$(UNIT_COMPILE_$(1)) $$(UNIT_CORE_WARNINGS_$(1)) $$(HOST_ROBOT_FLAGS) -c $$< -o $$@

build/unit/$(1)/librobot.a: $$(UNIT_ROBOT_$(1))
	@rm -f $$@ && ar rcs $$@ $$^

$$(UNIT_ARCHIVES_$(1)): build/unit/$(1)/lib%.a: $$(UNIT_CORE_$(1))
	@rm -f $$@ && ar rcs $$@ $$(LIBRARY_SOURCES_$$*:%.c=build/unit/$(1)/%.o)

$$(UNIT_PROGRAMS_$(1)): build/unit/$(1)/bin/%: build/unit/$(1)/tests/unit/%.o build/unit/$(1)/helpers.a \
    $$(UNIT_ARCHIVES_$(1)) build/unit/$(1)/librobot.a
	@mkdir -p $$(@D)
	@$$(CC) $$(UNIT_SANITIZE_$(1)) $$< build/unit/$(1)/helpers.a \
	    $$(patsubst %,build/unit/$(1)/lib%.a,$$(call unit_library,$$(firstword $$(subst /, ,$$*)))) \
	    $$(CMOCKA_LIBS) -lm -o $$@

# One line for a program that passes, everything it wrote for one that fails.
.PHONY: $$(UNIT_PROGRAMS_$(1):%=%.run)
$$(UNIT_PROGRAMS_$(1):%=%.run): %.run: %
	@if $$< >$$<.log 2>&1; then sed -n 's|^\[  PASSED  \]|unit $(1) $$(notdir $$<):|p' $$<.log; \
	 else cat $$<.log >&2; echo "unit $(1) $$(notdir $$<): FAILED" >&2; exit 1; fi

-include $$(UNIT_CORE_$(1):.o=.d) $$(UNIT_ROBOT_$(1):.o=.d) $$(UNIT_HELPERS:%.c=build/unit/$(1)/%.d)
-include $$(UNIT_SOURCES:%.c=build/unit/$(1)/%.d)
endef
$(foreach real,$(UNIT_REALS) plain,$(eval $(call unit_rules,$(real))))

# Asked when a test is compiled, not when make starts: `make setup` may have installed CMocka in between.
CMOCKA_CFLAGS = $(shell pkg-config --cflags cmocka)
CMOCKA_LIBS = $(shell pkg-config --libs cmocka)

# The objects of the tests are wanted again at the next run.
.SECONDARY:
