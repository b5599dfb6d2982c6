# Modified condition/decision coverage of the core by the C unit tests: each condition of a decision has been
# shown to change its outcome by itself. clang instruments the core, as one shared library, so that every test
# adds to one account; tools/mcdc.py prints it.

MCDC_COMPILE := $(CLANG) $(C_STANDARD) $(C_INCLUDES) $(UNIT_FLAGS_float) -O1 -g -MMD -MP
MCDC_COVERAGE := -fprofile-instr-generate -fcoverage-mapping -fcoverage-mcdc
MCDC_CORE := $(CORE_SOURCES:%.c=build/mcdc/%.o)
MCDC_HELPERS := $(UNIT_HELPERS:%.c=build/mcdc/%.o)
MCDC_PROGRAMS := $(UNIT_SOURCES:tests/unit/%.c=build/mcdc/bin/%)

$(MCDC_CORE): build/mcdc/%.o: %.c mk/config.mk mk/mcdc.mk
	@mkdir -p $(@D)
	@$(MCDC_COMPILE) -fPIC $(MCDC_COVERAGE) -Werror -c $< -o $@

build/mcdc/libbslam.so: $(MCDC_CORE)
	@$(CLANG) -shared $(MCDC_COVERAGE) $^ -lm -o $@

build/mcdc/tests/%.o: tests/%.c mk/config.mk mk/mcdc.mk
	@mkdir -p $(@D)
	@$(MCDC_COMPILE) -Itests/unit $(CMOCKA_CFLAGS) -c $< -o $@

$(MCDC_PROGRAMS): build/mcdc/bin/%: build/mcdc/tests/unit/%.o $(MCDC_HELPERS) build/mcdc/libbslam.so
	@mkdir -p $(@D)
	@$(CLANG) $(MCDC_COVERAGE) $^ -Wl,-rpath,$(CURDIR)/build/mcdc $(CMOCKA_LIBS) -lm -o $@

-include $(MCDC_CORE:.o=.d) $(MCDC_HELPERS:.o=.d) $(UNIT_SOURCES:%.c=build/mcdc/%.d)

# What is listed: MCDC="--list vision/lens.c".
MCDC :=

.PHONY: mcdc-programs mcdc
mcdc-programs:
	@tools/setup.sh proof
	@$(MAKE) --no-print-directory --silent $(MCDC_PROGRAMS)

mcdc: mcdc-programs ## MC/DC of the core by the C unit tests (clang); fails below 95 %
	@$(PYTHON) tools/mcdc.py $(MCDC)
