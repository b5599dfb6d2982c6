# Modified condition/decision coverage of the core: each condition of a decision has been shown to change its
# outcome by itself. clang instruments the core, as one shared library, so that every program that runs it
# adds to one account: the C unit tests to that of build/mcdc/unit, the inputs that fuzzing kept to that of
# build/mcdc/replay, where the core has the small sizes of tests/fuzz/sizes.h. mcdc.py prints them.

MCDC_COVERAGE := -fprofile-instr-generate -fcoverage-mapping -fcoverage-mcdc
MCDC_FLAGS_unit := $(UNIT_FLAGS_float)
MCDC_FLAGS_replay := $(FUZZ_DEFINES)
MCDC_PROGRAMS := $(UNIT_SOURCES:tests/unit/%.c=build/mcdc/unit/bin/%) \
    $(FUZZ_TARGETS:%=build/mcdc/replay/bin/%)
# What stands between a program and the core.
MCDC_HELPERS_unit := $(UNIT_HELPERS:%.c=build/mcdc/unit/%.o)
MCDC_HELPERS_replay := build/mcdc/replay/tests/fuzz/replay.o build/mcdc/replay/library.a

define mcdc_rules
MCDC_COMPILE_$(1) = $$(CLANG) $$(C_STANDARD) $$(C_INCLUDES) $$(MCDC_FLAGS_$(1)) -O1 -g -MMD -MP
MCDC_CORE_$(1) := $$(CORE_SOURCES:%.c=build/mcdc/$(1)/%.o)

$$(MCDC_CORE_$(1)): build/mcdc/$(1)/%.o: %.c mk/config.mk mk/fuzz.mk mk/mcdc.mk
	@mkdir -p $$(@D)
	@$$(MCDC_COMPILE_$(1)) -fPIC $$(MCDC_COVERAGE) -Werror -c $$< -o $$@

build/mcdc/$(1)/libbslam.so: $$(MCDC_CORE_$(1))
	@$$(CLANG) -shared $$(MCDC_COVERAGE) $$^ -lm -o $$@

build/mcdc/$(1)/%.o: %.c mk/config.mk mk/fuzz.mk mk/mcdc.mk
	@mkdir -p $$(@D)
	@$$(MCDC_COMPILE_$(1)) -Itests/unit $$(CMOCKA_CFLAGS) -c $$< -o $$@

build/mcdc/$(1)/bin/%: build/mcdc/$(1)/tests/$$(MCDC_FOLDER_$(1))/%.o $$(MCDC_HELPERS_$(1)) \
    build/mcdc/$(1)/libbslam.so
	@mkdir -p $$(@D)
	@$$(CLANG) $$(MCDC_COVERAGE) $$^ -Wl,-rpath,$$(CURDIR)/build/mcdc/$(1) $$(CMOCKA_LIBS) -lm -o $$@

-include $$(MCDC_CORE_$(1):.o=.d)
endef
MCDC_FOLDER_unit := unit
MCDC_FOLDER_replay := fuzz
$(foreach account,unit replay,$(eval $(call mcdc_rules,$(account))))

build/mcdc/replay/library.a: $(patsubst %.c,build/mcdc/replay/%.o,$(FUZZ_ROBOT) $(FUZZ_HELPERS))
	@rm -f $@ && ar rcs $@ $^

-include $(MCDC_HELPERS_unit:.o=.d) $(UNIT_SOURCES:%.c=build/mcdc/unit/%.d)
-include $(patsubst %.c,build/mcdc/replay/%.d,$(FUZZ_ROBOT) $(FUZZ_HELPERS) $(FUZZ_TARGETS:%=tests/fuzz/%.c))

# What is listed: MCDC="--list vision/camera/lens.c".
MCDC :=

.PHONY: mcdc-programs mcdc
mcdc-programs:
	@tools/setup.sh proof
	@$(MAKE) --no-print-directory --silent $(MCDC_PROGRAMS)

mcdc: mcdc-programs ## MC/DC of the core by the C unit tests and what fuzzing kept (clang); fails below 95 %
	@$(PYTHON) -m tools.proofs.mcdc $(MCDC)
