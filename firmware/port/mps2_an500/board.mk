# Arm's MPS2 board AN500 in QEMU: Cortex-M7.
BOARD_CORE_mps2_an500 := m7
BOARD_SOURCES_mps2_an500 := firmware/port/mps2/port.c $(PORT_SOURCES)
BOARD_FLAGS_mps2_an500 := -DUART_BASE=0x40004000u -DCORE_HZ=25000000u -DFILM_ADDRESS=0x20200000u $(HOST_SIZES)
BOARD_QEMU_mps2_an500 := mps2-an500
BOARD_PROGRAMS_mps2_an500 := cost cost_vision cost_smoother
