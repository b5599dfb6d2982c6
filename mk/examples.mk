# The programs of examples/ for a Cortex-M4F, at -Os, and what each takes of flash and RAM. Of Arduino's core
# and ESP-IDF nothing is counted: their functions stay unresolved. tests/python/examples runs them here.

EXAMPLES_DIR := build/examples
EXAMPLES_ARM := $(ARM)gcc -mthumb $(TARGET_FLAGS_m4f) -Os -ffunction-sections -fdata-sections $(C_INCLUDES)
EXAMPLES_LINK := -Wl,--gc-sections -Wl,--no-warn-rwx-segments
# A board's functions, which are not there.
EXAMPLES_NO_BOARD := -nostartfiles --specs=nano.specs --specs=nosys.specs -Wl,--unresolved-symbols=ignore-all
EXAMPLES_STUBS := tests/python/examples/stubs
EXAMPLES_LIBRARY := $(EXAMPLES_DIR)/libbslam.a
EXAMPLES_OBJECTS := $(LIBRARY_SOURCES_bslam:%.c=$(EXAMPLES_DIR)/%.o)
# A program of the desktop links a C library whose files and screen are a debugger's.
EXAMPLES_HOSTED := keep_the_map desktop_csv
EXAMPLES_BUILT := stm32 arduino esp_idf $(EXAMPLES_HOSTED) camera_tags

$(EXAMPLES_OBJECTS): $(EXAMPLES_DIR)/%.o: %.c mk/config.mk mk/examples.mk
	@mkdir -p $(@D)
	@$(EXAMPLES_ARM) $(C_STANDARD) -fno-math-errno -MMD -MP -c $< -o $@

$(EXAMPLES_LIBRARY): $(EXAMPLES_OBJECTS)
	@rm -f $@ && $(ARM)ar rcs $@ $^

.PHONY: $(EXAMPLES_DIR)/stm32.elf
$(EXAMPLES_DIR)/stm32.elf:
	@cmake -S examples/stm32 -B $(EXAMPLES_DIR)/stm32 -DBSLAM_CORE=m4f -DCMAKE_BUILD_TYPE=MinSizeRel \
	    -DCMAKE_TOOLCHAIN_FILE=$(CURDIR)/firmware/cmake/cortex-m.cmake >/dev/null
	@cmake --build $(EXAMPLES_DIR)/stm32 >/dev/null
	@cp $(EXAMPLES_DIR)/stm32/robot.elf $@

# Linked by the C compiler: nothing of C++'s own library is asked for.
$(EXAMPLES_DIR)/arduino.o: examples/arduino/bslam_robot/bslam_robot.ino $(EXAMPLES_STUBS)/arduino/Arduino.h
	@mkdir -p $(@D)
	@$(subst gcc,g++,$(EXAMPLES_ARM)) -std=gnu++11 -fno-exceptions -fno-rtti -fno-threadsafe-statics \
	    -Wall -Wextra -Werror -I$(EXAMPLES_STUBS)/arduino -include Arduino.h -x c++ -c $< -o $@

$(EXAMPLES_DIR)/arduino.elf: $(EXAMPLES_DIR)/arduino.o $(EXAMPLES_LIBRARY)
	@$(EXAMPLES_ARM) $^ $(EXAMPLES_LINK) $(EXAMPLES_NO_BOARD) -Wl,--entry=_Z5setupv \
	    -Wl,--undefined=_Z4loopv -lm -o $@

$(EXAMPLES_DIR)/esp_idf.elf: examples/esp_idf/main/main.c $(EXAMPLES_LIBRARY)
	@$(EXAMPLES_ARM) -std=gnu11 -Wall -Wextra -Werror -I$(EXAMPLES_STUBS)/esp_idf $< $(EXAMPLES_LIBRARY) \
	    $(EXAMPLES_LINK) $(EXAMPLES_NO_BOARD) -Wl,--entry=app_main -lm -o $@

$(EXAMPLES_HOSTED:%=$(EXAMPLES_DIR)/%.elf): $(EXAMPLES_DIR)/%.elf: $(EXAMPLES_LIBRARY) \
    $(foreach name,$(EXAMPLES_HOSTED),examples/$(name)/$(name).c)
	@$(EXAMPLES_ARM) -std=c11 -Wall -Wextra -Werror examples/$*/$*.c $(EXAMPLES_LIBRARY) $(EXAMPLES_LINK) \
	    --specs=rdimon.specs -lm -o $@

# What it runs in Python is the library that a board would link: odometry, sightings, pose, map.
$(EXAMPLES_DIR)/camera_tags.elf: tests/bench/link_core.c $(EXAMPLES_LIBRARY)
	@$(EXAMPLES_ARM) -std=c11 $< $(EXAMPLES_LIBRARY) $(EXAMPLES_LINK) -nostartfiles --specs=nano.specs \
	    --specs=nosys.specs -Wl,--entry=main -lm -o $@

# Of files $(1), each under its own name.
examples_rows = for elf in $(1); do $(ARM)size $$elf | awk -v name=$$(basename $$elf .elf) \
    'END { printf "%-14s %8d %8d\n", name, $$1 + $$2, $$2 + $$3 }'; done

EXAMPLES_ELFS := $(EXAMPLES_BUILT:%=$(EXAMPLES_DIR)/%.elf)
.PHONY: examples examples-built
examples-built: $(EXAMPLES_ELFS)
	@$(call examples_rows,$^)

# The live robot is the micro:bit's image, at -O2.
$(EXAMPLES_DIR)/live_robot.elf: build/microbit/robot.elf
	@mkdir -p $(@D) && cp $< $@

examples: $(EXAMPLES_ELFS) $(EXAMPLES_DIR)/live_robot.elf ## build examples/, print their flash and RAM
	@printf '%-14s %8s %8s   bytes\n' example flash RAM
	@$(call examples_rows,$^)

# Their style is the house's.
C_FILES += $(wildcard examples/*/*.[ch] examples/*/*/*.[ch] $(EXAMPLES_STUBS)/*.h $(EXAMPLES_STUBS)/*/*.h \
    $(EXAMPLES_STUBS)/*/*.c* $(EXAMPLES_STUBS)/*/*/*.h)
PYTHON_DIRS += examples

-include $(EXAMPLES_OBJECTS:.o=.d)
