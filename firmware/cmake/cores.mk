# The flags of each Cortex-M: for mk/firmware.mk, and for cortex-m.cmake, which takes them line by line.
TARGET_FLAGS_m0plus := -mcpu=cortex-m0plus
TARGET_FLAGS_m4f := -mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard
TARGET_FLAGS_m7 := -mcpu=cortex-m7 -mfpu=fpv5-sp-d16 -mfloat-abi=hard
TARGET_FLAGS_m33 := -mcpu=cortex-m33 -mfpu=fpv5-sp-d16 -mfloat-abi=hard
# Without its vector extension (MVE), whose floating point flushes denormals to zero: other bits.
TARGET_FLAGS_m55 := -mcpu=cortex-m55+nomve -mfpu=fpv5-sp-d16 -mfloat-abi=hard
