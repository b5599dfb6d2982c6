# A toolchain file for Cortex-M:
#
#     cmake -S firmware -B build/cmake -DCMAKE_TOOLCHAIN_FILE=firmware/cmake/cortex-m.cmake -DBSLAM_CORE=m4f
#
# The flags of a core stand in mk/firmware.mk, and only there.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
# Projects that CMake makes to try the compiler are told the core, too.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES BSLAM_CORE)
if(NOT BSLAM_CORE)
    set(BSLAM_CORE m4f)
endif()

set(BSLAM_FLAGS_FILE "${CMAKE_CURRENT_LIST_DIR}/../../mk/firmware.mk")
file(STRINGS "${BSLAM_FLAGS_FILE}" BSLAM_CORE_LINE REGEX "^TARGET_FLAGS_${BSLAM_CORE} := ")
if(NOT BSLAM_CORE_LINE OR BSLAM_CORE MATCHES "^rv")
    message(FATAL_ERROR "BSLAM_CORE is ${BSLAM_CORE}; allowed: m0plus, m4f, m7, m33")
endif()
string(REGEX REPLACE "^TARGET_FLAGS_[a-z0-9]+ := " "" BSLAM_CORE_FLAGS "${BSLAM_CORE_LINE}")
foreach(language C CXX ASM)  # one ABI, whatever a program is written in
    set(CMAKE_${language}_FLAGS_INIT "-mthumb ${BSLAM_CORE_FLAGS}")
endforeach()
