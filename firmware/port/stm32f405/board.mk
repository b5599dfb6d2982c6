# STM32F405, a real part: Cortex-M4F at 168 MHz, 1 MB flash, 128 KB RAM. QEMU's netduinoplus2 runs the very
# image. Sizes as they are by default, 20 beacons, which learn appearance.
BOARD_CORE_stm32f405 := m4f
BOARD_SOURCES_stm32f405 := $(wildcard firmware/port/stm32f405/*.c) $(PORT_SOURCES)
BOARD_FLAGS_stm32f405 := -DCORE_HZ=168000000u -DFILM_ADDRESS=0x08040000u -DBSLAM_APPEARANCE=1
BOARD_QEMU_stm32f405 := netduinoplus2
