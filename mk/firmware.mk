# The libraries for a microcontroller: build/<core>/libbslam.a, libvision.a and liblink.a. TARGET picks the
# core; or a board, and then its images are linked (mk/images.mk). SIZES="-DBSLAM_BEACONS_MAX=50" sets what
# the application sets, too.

TARGET ?= m4f
SIZES :=
BEACONS ?= 6 20 50

ARM := arm-none-eabi-
RISCV := riscv64-unknown-elf-
include firmware/cmake/cores.mk
# With all that is left out by itself: for the symbols, the stack and the sizes of all code.
TARGET_FLAGS_m4f_whole := $(TARGET_FLAGS_m4f) -DBSLAM_APPEARANCE=1 -DBSLAM_SMOOTHER=1 -DBSLAM_GUARD=2
# Single precision in hardware, as on ESP32-P4, CH32V307 or GD32VF; with a library of its own, since Debian's
# compiler comes without.
TARGET_FLAGS_rv32 := -march=rv32imafc -mabi=ilp32f
TARGETS := $(patsubst TARGET_FLAGS_%,%,$(filter TARGET_FLAGS_%,$(.VARIABLES)))

# Of a core $(1): the tools' prefix, the flags of every build.
TOOLS_FOR = $(if $(filter rv%,$(1)),$(RISCV),$(ARM))
FLAGS_FOR = $(if $(filter rv%,$(1)),--specs=picolibc.specs -msmall-data-limit=0,-mthumb) $(TARGET_FLAGS_$(1))

# The tools for RISC-V take 1.4 GB, so nothing installs them unasked: what needs them is left out of `all`
# where they are missing, and says so where it is asked for.
HAS_RISCV := $(shell command -v $(RISCV)gcc)
CAN_BUILD = $(if $(filter rv%,$(1)),$(HAS_RISCV),yes)

include mk/images.mk

ifeq ($(filter $(TARGET),$(TARGETS) $(BOARDS)),)
$(error TARGET is $(TARGET); allowed: $(sort $(TARGETS)), and the boards $(sort $(BOARDS)))
endif

# A RISC-V core saves a few more registers.
STACK_MAX_FOR = $(if $(filter rv%,$(1)),1280,1152)

.PHONY: firmware
ifeq ($(call CAN_BUILD,$(or $(BOARD_CORE_$(TARGET)),$(TARGET))),)
firmware:
	@echo "firmware: $(RISCV)gcc is not installed: install it with: sudo apt-get install" \
	    "gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf qemu-system-misc" >&2; exit 2
else
firmware: $(if $(filter $(TARGET),$(BOARDS)),image,library)-$(TARGET) ## build for TARGET: a core or a board
endif

# What costs flash at -Os: loops that become calls of memmove, which nothing else needs; constants of a loop
# kept in registers, which are saved and restored for it; functions with one caller, inlined with the same
# end; instructions in an order for pipelines, which takes registers too; values worked out again where
# they are used, which takes registers longer.
SMALLER := -fno-tree-loop-distribute-patterns -fno-move-loop-invariants -fno-inline-functions-called-once \
    -fno-schedule-insns2 -fno-tree-forwprop

# The rules for one core: $(1) is its name.
define core_rules
CORE_OBJECTS_$(1) := $(patsubst %.c,build/$(1)/%.o,$(call sources_for,$(CORE_SOURCES),$(SIZES)))
CORE_COMPILE_$(1) := $(call TOOLS_FOR,$(1))gcc $(C_STANDARD) $(C_INCLUDES) $(call FLAGS_FOR,$(1)) -Os -g \
    $(SMALLER) -fno-math-errno -DBSLAM_SETTING_MEANINGS=0 $(SIZES) \
    -ffunction-sections -fdata-sections \
    $(C_WARNINGS) $(C_WARNINGS_FLOAT) -Wstack-usage=$(call STACK_MAX_FOR,$(1))

CORE_ARCHIVES_$(1) := $(LIBRARIES:%=build/$(1)/lib%.a)

.PHONY: library-$(1)
library-$(1): $$(CORE_ARCHIVES_$(1))
	@$$(PLAIN_PYTHON) -m tools.checks.check_symbols --nm $(call TOOLS_FOR,$(1))nm $$^
	@for archive in $$^; do $(call TOOLS_FOR,$(1))size --totals $$$$archive | \
	    awk "END { printf \"$$$$archive: %d bytes of code and constants\\n\", \$$$$1 }"; done

$$(CORE_ARCHIVES_$(1)): build/$(1)/lib%.a: $$(CORE_OBJECTS_$(1))
	@rm -f $$@
	@$(call TOOLS_FOR,$(1))ar rcs $$@ $$(filter $$(LIBRARY_SOURCES_$$*:%.c=build/$(1)/%.o),$$^)

$$(CORE_OBJECTS_$(1)): build/$(1)/%.o: %.c mk/config.mk mk/firmware.mk \
    firmware/cmake/cores.mk
	@mkdir -p $$(@D)
	@$$(CORE_COMPILE_$(1)) -MMD -MP -c $$< -o $$@

-include $$(CORE_OBJECTS_$(1):.o=.d)
endef
$(foreach core,$(TARGETS),$(eval $(call core_rules,$(core))))

.PHONY: firmware-all
TARGET_LIBRARIES := $(foreach core,$(TARGETS),$(if $(call CAN_BUILD,$(core)),library-$(core)))
firmware-all: $(TARGET_LIBRARIES) images ## the library for every core, the images for every board

.PHONY: sizes
sizes: ## print how much RAM an instance takes, by number of beacons and what it has
	@$(PLAIN_PYTHON) -m tools.checks.sizes --beacons $(BEACONS) \
	    --compiler "host" "$(CC) $(C_STANDARD) $(C_INCLUDES) $(SIZES)" nm \
	    --compiler "m4f" "$(ARM)gcc $(C_STANDARD) $(C_INCLUDES) -mthumb $(TARGET_FLAGS_m4f) $(SIZES)" $(ARM)nm
