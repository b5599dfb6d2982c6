# The application on FreeRTOS, for a board with a Cortex-M4F: make rtos FREERTOS_KERNEL=PATH, where PATH
# is a checkout of the FreeRTOS-Kernel repository. Nothing of it is copied here.

RTOS_BOARD := $(if $(filter $(TARGET),$(BOARDS)),$(TARGET),mps2_an386)
RTOS_DIR := build/$(RTOS_BOARD)/rtos
RTOS_PORT := $(FREERTOS_KERNEL)/portable/GCC/ARM_CM4F
RTOS_KERNEL := $(addprefix $(FREERTOS_KERNEL)/,tasks.c queue.c list.c) $(RTOS_PORT)/port.c
RTOS_OBJECTS := $(patsubst %.c,$(RTOS_DIR)/%.o,$(notdir $(RTOS_KERNEL))) $(RTOS_DIR)/robot_rtos.o
RTOS_INCLUDES := -Ifirmware/robot/rtos -isystem $(FREERTOS_KERNEL)/include -isystem $(RTOS_PORT)
RTOS_IMAGE := build/$(RTOS_BOARD)/robot_rtos.elf

.PHONY: rtos
ifeq ($(wildcard $(RTOS_PORT)/port.c),)
rtos: ## the robot on FreeRTOS: FREERTOS_KERNEL=PATH to its sources
	@echo "rtos: FREERTOS_KERNEL='$(FREERTOS_KERNEL)' is no FreeRTOS kernel; get one with:" \
	    "git clone --branch V11.2.0 --depth 1 https://github.com/FreeRTOS/FreeRTOS-Kernel" >&2; exit 2
else ifneq ($(BOARD_CORE_$(RTOS_BOARD)),m4f)
rtos:
	@echo "rtos: TARGET=$(TARGET) is no board with a Cortex-M4F; allowed:" \
	    "$(foreach board,$(BOARDS),$(if $(filter m4f,$(BOARD_CORE_$(board))),$(board)))" >&2; exit 2
else
rtos: $(RTOS_IMAGE)
endif

$(RTOS_DIR)/robot_rtos.o: firmware/robot/rtos/robot_rtos.c
	@mkdir -p $(@D)
	@$(BOARD_COMPILE_$(RTOS_BOARD)) $(RTOS_INCLUDES) -MMD -MP -c $< -o $@

# The kernel's own warnings are its own business.
$(RTOS_DIR)/%.o: $(FREERTOS_KERNEL)/%.c
	@mkdir -p $(@D)
	@$(BOARD_CC_$(RTOS_BOARD)) $(C_INCLUDES) $(RTOS_INCLUDES) $(IMAGE_FLAGS) -MMD -MP -c $< -o $@

$(RTOS_DIR)/%.o: $(RTOS_PORT)/%.c
	@mkdir -p $(@D)
	@$(BOARD_CC_$(RTOS_BOARD)) $(C_INCLUDES) $(RTOS_INCLUDES) $(IMAGE_FLAGS) -MMD -MP -c $< -o $@

$(RTOS_IMAGE): $(RTOS_OBJECTS) $(BOARD_OBJECTS_$(RTOS_BOARD))
	@$(BOARD_CC_$(RTOS_BOARD)) $(IMAGE_LINK) $(call LIBC_FOR,m4f) \
	    -T firmware/port/$(RTOS_BOARD)/memory.ld $^ -lm -o $@
	@$(PLAIN_PYTHON) -m tools.checks.check_image $@ --objects build/$(RTOS_BOARD)

-include $(RTOS_OBJECTS:.o=.d)
