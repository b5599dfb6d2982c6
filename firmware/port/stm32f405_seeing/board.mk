# The same part with eyes: the front end for one QVGA camera and 14 beacons in its 128 KB of RAM. Beacons are
# told apart by place: what learns looks has no room beside.
BOARD_CORE_stm32f405_seeing := m4f
BOARD_SOURCES_stm32f405_seeing := $(wildcard firmware/port/stm32f405/*.c) $(PORT_SOURCES)
BOARD_FLAGS_stm32f405_seeing := -DCORE_HZ=168000000u -DFILM_ADDRESS=0x08040000u -DROBOT_VISION=1 \
    -DBSLAM_CAMERAS_MAX=1 -DBSLAM_VISION_TURNS=0 -DBSLAM_BEACONS_MAX=14 -DBSLAM_RAYS_MAX=3
BOARD_QEMU_stm32f405_seeing := netduinoplus2
