# QEMU's `virt` machine with an RV32IMAFC core: no part that is sold, but the instructions of those that are.
BOARD_CORE_riscv_virt := rv32
BOARD_SOURCES_riscv_virt := firmware/port/riscv_virt/port.c $(RISCV_PORT_SOURCES)
BOARD_FLAGS_riscv_virt := -DFILM_ADDRESS=0x80800000u $(HOST_SIZES)
BOARD_QEMU_riscv_virt := virt
BOARD_EMULATOR_riscv_virt := qemu-system-riscv32
