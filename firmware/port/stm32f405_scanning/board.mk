# The same part with eyes for your own kinds: a scanner for one QVGA camera, and 20 beacons. KINDS is the header
# that `bslam detect train` wrote.
BOARD_CORE_stm32f405_scanning := m4f
BOARD_SOURCES_stm32f405_scanning := $(wildcard firmware/port/stm32f405/*.c) $(PORT_SOURCES)
BOARD_FLAGS_stm32f405_scanning := -DCORE_HZ=168000000u -DFILM_ADDRESS=0x08040000u -DROBOT_VISION=1 \
    -DBSLAM_CAMERAS_MAX=1 -DBSLAM_VISION_BUILT_IN=0 -DBSLAM_BEACONS_MAX=20 -DBSLAM_RAYS_MAX=3 \
    -DROBOT_KINDS=bslam_$(basename $(notdir $(KINDS))) '-DROBOT_KINDS_HEADER="$(abspath $(KINDS))"'
BOARD_QEMU_stm32f405_scanning := netduinoplus2

# Built again where another KINDS is named.
build/stm32f405_scanning/kinds: always
	@mkdir -p $(@D)
	@echo '$(KINDS)' | cmp -s - $@ || echo '$(KINDS)' > $@
build/stm32f405_scanning/firmware/robot/camera_input.o: build/stm32f405_scanning/kinds
.PHONY: always
