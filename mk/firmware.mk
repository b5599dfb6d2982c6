# The core as a static library for a microcontroller: build/<target>/libbslam.a. TARGET picks the core.

TARGET ?= m4f

ARM := arm-none-eabi-
TARGET_FLAGS_m0plus := -mcpu=cortex-m0plus
TARGET_FLAGS_m4f := -mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard
TARGET_FLAGS_m7 := -mcpu=cortex-m7 -mfpu=fpv5-sp-d16 -mfloat-abi=hard
TARGET_FLAGS_m33 := -mcpu=cortex-m33 -mfpu=fpv5-sp-d16 -mfloat-abi=hard
TARGETS := $(patsubst TARGET_FLAGS_%,%,$(filter TARGET_FLAGS_%,$(.VARIABLES)))
ifeq ($(filter $(TARGET),$(TARGETS)),)
$(error TARGET is $(TARGET); allowed: $(sort $(TARGETS)))
endif

STACK_BYTES_MAX := 1024

TARGET_DIR := build/$(TARGET)
TARGET_LIBRARY := $(TARGET_DIR)/libbslam.a
TARGET_OBJECTS := $(CORE_SOURCES:%.c=$(TARGET_DIR)/%.o)
TARGET_COMPILE := $(ARM)gcc $(C_STANDARD) $(C_INCLUDES) -mthumb $(TARGET_FLAGS_$(TARGET)) -Os -g \
    -ffunction-sections -fdata-sections $(C_WARNINGS) $(C_WARNINGS_FLOAT) -Wstack-usage=$(STACK_BYTES_MAX)

.PHONY: firmware
firmware: $(TARGET_LIBRARY) ## cross-compile the core for TARGET (m4f; m0plus, m7, m33) and check its symbols
	@$(PYTHON) tools/check_symbols.py --nm $(ARM)nm $<
	@$(ARM)size --totals $< | awk 'END { printf "firmware $(TARGET): %d bytes of code and constants\n", $$1 }'

$(TARGET_LIBRARY): $(TARGET_OBJECTS)
	@rm -f $@
	@$(ARM)ar rcs $@ $^

$(TARGET_OBJECTS): $(TARGET_DIR)/%.o: %.c mk/config.mk mk/firmware.mk
	@mkdir -p $(@D)
	@$(TARGET_COMPILE) -MMD -MP -c $< -o $@

-include $(TARGET_OBJECTS:.o=.d)

.PHONY: firmware-all
firmware-all: ## the same for every TARGET
	@set -e; for target in $(sort $(TARGETS)); do $(MAKE) --silent firmware TARGET=$$target; done

.PHONY: sizes
sizes: ## print how much RAM an instance takes, by number of beacons
	@$(PYTHON) tools/sizes.py --beacons 6 20 50 --learner 6 32 64 \
	    --compiler "host" "$(CC) $(C_STANDARD) $(C_INCLUDES)" nm \
	    --compiler "$(TARGET)" "$(ARM)gcc $(C_STANDARD) $(C_INCLUDES) -mthumb $(TARGET_FLAGS_$(TARGET))" $(ARM)nm
