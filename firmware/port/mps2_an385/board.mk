# Arm's MPS2 board AN385 in QEMU. Its Cortex-M3 executes the Cortex-M0+ image: every ARMv6-M instruction is an
# ARMv7-M one, and QEMU has no board with an M0+.
BOARD_CORE_mps2_an385 := m0plus
BOARD_SOURCES_mps2_an385 := firmware/port/mps2/port.c $(PORT_SOURCES)
BOARD_FLAGS_mps2_an385 := -DUART_BASE=0x40004000u -DCORE_HZ=25000000u -DFILM_ADDRESS=0x20200000u $(HOST_SIZES)
BOARD_QEMU_mps2_an385 := mps2-an385
BOARD_PROGRAMS_mps2_an385 := cost cost_vision
