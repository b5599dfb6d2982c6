# The C core: its files, and the flags every build of it shares.

CORE_SOURCES := $(sort $(wildcard firmware/bslam/*.c firmware/bslam/*/*.c))
CORE_HEADERS := $(sort $(wildcard firmware/bslam/*.h firmware/bslam/*/*.h))

# Contraction (fused multiply-add) would change the last bit from one machine to the next.
C_STANDARD := -std=c11 -ffp-contract=off

C_INCLUDES := -Ifirmware

C_WARNINGS := -Wall -Wextra -Werror -Wconversion -Wfloat-conversion -Wshadow -Wvla -Wundef \
    -Wstrict-prototypes -Wmissing-prototypes -Wcast-align -Wwrite-strings

# In the float build a double is a mistake: it costs a library call on a Cortex-M4F.
C_WARNINGS_FLOAT := -Wdouble-promotion -Wunsuffixed-float-constants
