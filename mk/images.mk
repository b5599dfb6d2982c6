# Complete images: the library, the application and a board's port, linked to build/<board>/robot.elf. A board
# is a folder firmware/port/<board> with board.mk (core, sources, flags, QEMU's name for it) and memory.ld:
# there is no list to keep.

BOARDS := $(patsubst firmware/port/%/board.mk,%,$(wildcard firmware/port/*/board.mk))

# Of a board that scans: the header that `bslam detect train` wrote.
KINDS ?= firmware/models/own_room.h

# What boards may use.
PORT_SOURCES := $(wildcard firmware/port/*.c firmware/port/cortex_m/*.c)
RISCV_PORT_SOURCES := $(wildcard firmware/port/*.c firmware/port/riscv/*.c)
# The sizes of the host's largest build (bslam_build.py), so that a board with much memory answers as it does,
# the front end for pictures, turns seen, and the smoother.
HOST_SIZES := -DROBOT_VISION=1 -DBSLAM_APPEARANCE=1 -DBSLAM_SMOOTHER=1 -DSESSION_MAP_BYTES=65536 \
    -DBSLAM_BEACONS_MAX=80 -DBSLAM_RAYS_MAX=80 -DBSLAM_SIGHTINGS_MAX=96 -DBSLAM_HISTORY_MAX=128

include $(BOARDS:%=firmware/port/%/board.mk)

# What every board runs; a board with memory enough adds to (BOARD_PROGRAMS_<board>).
PROGRAMS := robot selftest

# How hard the compiler tries: make -B IMAGE_LEVEL=-O3 ... asks what another level costs. A square root needs
# no errno. The stack that each function takes is for tools/checks/check_image.py.
IMAGE_LEVEL := -O2
IMAGE_FLAGS := $(IMAGE_LEVEL) -g -ffunction-sections -fdata-sections -fno-math-errno -fstack-usage \
    -DBSLAM_SETTING_MEANINGS=0

IMAGE_LINK := -nostartfiles -Wl,--gc-sections -Wl,--build-id=sha1 \
    -Wl,--fatal-warnings -Wl,--no-warn-rwx-segments

LIBC_FOR = $(if $(filter rv%,$(1)),,--specs=nano.specs --specs=nosys.specs)

# The rules for one board: $(1) is its name.
define board_rules
BOARD_CC_$(1) := $(call TOOLS_FOR,$(BOARD_CORE_$(1)))gcc $(call FLAGS_FOR,$(BOARD_CORE_$(1)))
BOARD_COMPILE_$(1) := $$(BOARD_CC_$(1)) $(C_STANDARD) $(C_INCLUDES) $(IMAGE_FLAGS) $(BOARD_FLAGS_$(1)) \
    $(C_WARNINGS) $(C_WARNINGS_FLOAT)
BOARD_OBJECTS_$(1) := $(patsubst %.c,build/$(1)/%.o,$(ROBOT_SOURCES) $(BOARD_SOURCES_$(1)) \
    $(call sources_for,$(sort $(foreach library,$(or $(BOARD_LIBRARIES_$(1)),$(LIBRARIES)), \
    $(LIBRARY_SOURCES_$(library)))),$(BOARD_FLAGS_$(1))))
BOARD_ALL_$(1) := $(PROGRAMS) $(BOARD_PROGRAMS_$(1))
BOARD_MK_$(1) := mk/config.mk mk/firmware.mk mk/images.mk firmware/cmake/cores.mk firmware/port/$(1)/board.mk

build/$(1)/%.o: %.c $$(BOARD_MK_$(1))
	@mkdir -p $$(@D)
	@$$(BOARD_COMPILE_$(1)) -MMD -MP -c $$< -o $$@

build/$(1)/robot.elf: build/$(1)/firmware/robot/main.o
$$(filter-out build/$(1)/robot.elf,$$(BOARD_ALL_$(1):%=build/$(1)/%.elf)): build/$(1)/%.elf: \
    build/$(1)/firmware/bench/%.o
$$(BOARD_ALL_$(1):%=build/$(1)/%.elf): $$(BOARD_OBJECTS_$(1)) firmware/port/$(1)/memory.ld \
    firmware/port/sections.ld tools/checks/check_image.py
	@$$(BOARD_CC_$(1)) $$(IMAGE_LINK) $$(call LIBC_FOR,$$(BOARD_CORE_$(1))) \
	    -T firmware/port/$(1)/memory.ld $$(filter %.o,$$^) -lm -o $$@
	@$$(PLAIN_PYTHON) -m tools.checks.check_image $$@ --objects build/$(1) \
	    --tools $(call TOOLS_FOR,$(BOARD_CORE_$(1)))

.PHONY: image-$(1)
image-$(1): $$(BOARD_ALL_$(1):%=build/$(1)/%.elf)

-include $$(BOARD_OBJECTS_$(1):.o=.d) build/$(1)/firmware/robot/main.d \
    $$(BOARD_ALL_$(1):%=build/$(1)/firmware/bench/%.d)
endef
$(foreach board,$(BOARDS),$(eval $(call board_rules,$(board))))

# An image whose stack is too small, for `bslam faults`: tools/checks/check_image.py refuses it.
build/microbit/shallow.elf: build/microbit/robot.elf
	@$(BOARD_CC_microbit) $(IMAGE_LINK) $(call LIBC_FOR,m0plus) -Wl,--defsym=STACK=512 \
	    -T firmware/port/microbit/memory.ld build/microbit/firmware/robot/main.o $(BOARD_OBJECTS_microbit) \
	    -lm -o $@

# The application as a process of this computer, under the sanitizers, with the objects of the unit tests.
HOST_ROBOT := build/host/robot
HOST_ROBOT_SOURCES := $(ROBOT_SOURCES) firmware/robot/main.c \
    $(patsubst %,firmware/port/%.c,absent film posix/port)
HOST_ROBOT_OBJECTS := $(HOST_ROBOT_SOURCES:%.c=build/host/%.o)

$(HOST_ROBOT_OBJECTS): build/host/%.o: %.c mk/config.mk mk/images.mk
	@mkdir -p $(@D)
	@$(UNIT_COMPILE_float) $(C_WARNINGS) $(C_WARNINGS_FLOAT) $(HOST_ROBOT_FLAGS) -c $< -o $@

$(HOST_ROBOT): $(HOST_ROBOT_OBJECTS) $(UNIT_CORE_float)
	@$(CC) $(SANITIZE) $^ -lm -o $@

-include $(HOST_ROBOT_OBJECTS:.o=.d)

.PHONY: images
BUILT_BOARDS := $(foreach board,$(BOARDS),$(if $(call CAN_BUILD,$(BOARD_CORE_$(board))),image-$(board)))
images: $(BUILT_BOARDS) $(HOST_ROBOT) ## link the images of every board, and check them

.PHONY: selftest
selftest: images ## run the self-test of every board that QEMU has
	@$(PYTHON) -m tools.proofs.run_image selftest

.PHONY: sizes-doc check-sizes
sizes-doc: images library-m4f_whole ## measure flash, RAM, stack and instructions, write docs/SIZES.md
	@$(PYTHON) -m tools.checks.sizes_doc

check-sizes: images library-m4f_whole
	@$(PYTHON) -m tools.checks.sizes_doc --check
