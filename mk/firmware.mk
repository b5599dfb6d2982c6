# The core as a static library for a microcontroller: build/<core>/libbslam.a. TARGET picks the core; or a
# board, and then its images are linked (mk/images.mk).

TARGET ?= m4f

ARM := arm-none-eabi-
TARGET_FLAGS_m0plus := -mcpu=cortex-m0plus
TARGET_FLAGS_m4f := -mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard
TARGET_FLAGS_m7 := -mcpu=cortex-m7 -mfpu=fpv5-sp-d16 -mfloat-abi=hard
TARGET_FLAGS_m33 := -mcpu=cortex-m33 -mfpu=fpv5-sp-d16 -mfloat-abi=hard
TARGETS := $(patsubst TARGET_FLAGS_%,%,$(filter TARGET_FLAGS_%,$(.VARIABLES)))

include mk/images.mk

ifeq ($(filter $(TARGET),$(TARGETS) $(BOARDS)),)
$(error TARGET is $(TARGET); allowed: $(sort $(TARGETS)), and the boards $(sort $(BOARDS)))
endif

STACK_BYTES_MAX := 1024

.PHONY: firmware
firmware: $(if $(filter $(TARGET),$(BOARDS)),image,library)-$(TARGET) ## build for TARGET: a core or a board

# The rules for one core: $(1) is its name.
define core_rules
CORE_OBJECTS_$(1) := $(CORE_SOURCES:%.c=build/$(1)/%.o)
CORE_COMPILE_$(1) := $(ARM)gcc $(C_STANDARD) $(C_INCLUDES) -mthumb $(TARGET_FLAGS_$(1)) -Os -g \
    -fno-math-errno -DBSLAM_PARAM_MEANINGS=0 -ffunction-sections -fdata-sections \
    $(C_WARNINGS) $(C_WARNINGS_FLOAT) -Wstack-usage=$(STACK_BYTES_MAX)

.PHONY: library-$(1)
library-$(1): build/$(1)/libbslam.a
	@$$(PYTHON) tools/check_symbols.py --nm $$(ARM)nm $$<
	@$$(ARM)size --totals $$< | awk 'END { printf "firmware $(1): %d bytes of code and constants\n", $$$$1 }'

build/$(1)/libbslam.a: $$(CORE_OBJECTS_$(1))
	@rm -f $$@
	@$$(ARM)ar rcs $$@ $$^

$$(CORE_OBJECTS_$(1)): build/$(1)/%.o: %.c mk/config.mk mk/firmware.mk
	@mkdir -p $$(@D)
	@$$(CORE_COMPILE_$(1)) -MMD -MP -c $$< -o $$@

-include $$(CORE_OBJECTS_$(1):.o=.d)
endef
$(foreach core,$(TARGETS),$(eval $(call core_rules,$(core))))

.PHONY: firmware-all
firmware-all: $(TARGETS:%=library-%) images ## the library for every core, the images for every board

.PHONY: sizes
sizes: ## print how much RAM an instance takes, by number of beacons
	@$(PYTHON) tools/sizes.py --beacons 6 20 50 --learner 6 32 64 \
	    --compiler "host" "$(CC) $(C_STANDARD) $(C_INCLUDES)" nm \
	    --compiler "m4f" "$(ARM)gcc $(C_STANDARD) $(C_INCLUDES) -mthumb $(TARGET_FLAGS_m4f)" $(ARM)nm
