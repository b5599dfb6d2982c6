# Hours of kinds of life: tests/soak, in float and in double. The estimator alone.

SOAK_SOURCES := $(LIBRARY_SOURCES_bslam) $(wildcard tests/soak/*.c)

define soak_rules
build/soak/$(1)/%.o: %.c mk/config.mk mk/soak.mk
	@mkdir -p $$(@D)
	@$$(CC) $$(C_STANDARD) $$(C_INCLUDES) $$(UNIT_FLAGS_$(1)) $$(C_WARNINGS) -O2 -MMD -MP -c $$< -o $$@

build/soak/$(1)/soak: $$(SOAK_SOURCES:%.c=build/soak/$(1)/%.o)
	@$$(CC) $$^ -lm -o $$@

-include $$(SOAK_SOURCES:%.c=build/soak/$(1)/%.d)
endef
$(foreach real,$(UNIT_REALS),$(eval $(call soak_rules,$(real))))
SOAK_PROGRAMS := $(UNIT_REALS:%=build/soak/%/soak)

# What lives are led: SOAK="--lives rest spin --minutes 600 --seeds 1".
SOAK :=

.PHONY: soak soak-short
soak: $(SOAK_PROGRAMS) ## 6 simulated hours x 20 seeds, float beside double (5 min); SOAK="--lives --seeds 1"
	@$(PYTHON) -m tools.proofs.soak $(SOAK)

soak-short: $(SOAK_PROGRAMS)
	@$(PYTHON) -m tools.proofs.soak --minutes 30 --seeds 4 --nees 1.1 5.8
	@$(PYTHON) -m tools.proofs.soak --lives --minutes 3 --seeds 1 --reals float
