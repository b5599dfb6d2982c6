# Arm's MPS2 board AN505 in QEMU: Cortex-M33, in its secure state.
BOARD_CORE_mps2_an505 := m33
BOARD_SOURCES_mps2_an505 := firmware/port/mps2/port.c $(PORT_SOURCES)
BOARD_FLAGS_mps2_an505 := -DUART_BASE=0x50200000u -DCORE_HZ=25000000u -DFILM_ADDRESS=0x38200000u $(HOST_SIZES)
BOARD_QEMU_mps2_an505 := mps2-an505
