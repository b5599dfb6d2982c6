# Arm's MPS2 board AN386 in QEMU: Cortex-M4F.
BOARD_CORE_mps2_an386 := m4f
BOARD_SOURCES_mps2_an386 := firmware/port/mps2/port.c $(PORT_SOURCES)
BOARD_FLAGS_mps2_an386 := -DUART_BASE=0x40004000u -DCORE_HZ=25000000u -DFILM_ADDRESS=0x20200000u $(HOST_SIZES)
BOARD_QEMU_mps2_an386 := mps2-an386
BOARD_PROGRAMS_mps2_an386 := cost cost_vision cost_smoother
