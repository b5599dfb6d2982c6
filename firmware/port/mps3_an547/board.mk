# Arm's MPS3 board AN547 in QEMU: Cortex-M55, in its secure state; code in its ITCM, data in its SRAM.
BOARD_CORE_mps3_an547 := m55
BOARD_SOURCES_mps3_an547 := firmware/port/mps2/port.c $(PORT_SOURCES)
BOARD_FLAGS_mps3_an547 := -DUART_BASE=0x59303000u -DCORE_HZ=32000000u -DFILM_ADDRESS=0x31200000u $(HOST_SIZES)
BOARD_QEMU_mps3_an547 := mps3-an547
