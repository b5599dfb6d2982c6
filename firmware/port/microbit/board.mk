# BBC micro:bit, a real part: nRF51822, Cortex-M0 (the code of an M0+) at 16 MHz, 256 KB flash, 16 KB RAM. 6 beacons of given
# identity: what learns looks has no room. QEMU's microbit runs the very image.
BOARD_CORE_microbit := m0plus
BOARD_SOURCES_microbit := $(wildcard firmware/port/microbit/*.c) $(PORT_SOURCES)
BOARD_FLAGS_microbit := -DBSLAM_BEACONS_MAX=6 -DBSLAM_SIGHTINGS_MAX=6 -DBSLAM_HISTORY_MAX=8
BOARD_QEMU_microbit := microbit
BOARD_LIBRARIES_microbit := bslam link
