# A toolchain file for Cortex-M:
#
#     cmake -S firmware -B build/cmake -DCMAKE_TOOLCHAIN_FILE=firmware/cmake/cortex-m.cmake -DBSLAM_CORE=m4f
#
# The flags of a core stand in cores.mk, and only there.
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

file(STRINGS "${CMAKE_CURRENT_LIST_DIR}/cores.mk" BSLAM_CORES REGEX "^TARGET_FLAGS_")
list(TRANSFORM BSLAM_CORES REPLACE "^TARGET_FLAGS_" "")
set(BSLAM_CORE_LINE ${BSLAM_CORES})
list(FILTER BSLAM_CORE_LINE INCLUDE REGEX "^${BSLAM_CORE} := ")
if(NOT BSLAM_CORE_LINE)
    list(TRANSFORM BSLAM_CORES REPLACE " := .*" "")
    list(JOIN BSLAM_CORES ", " BSLAM_CORES)
    message(FATAL_ERROR "BSLAM_CORE is ${BSLAM_CORE}; allowed: ${BSLAM_CORES}")
endif()
string(REGEX REPLACE "^.* := " "" BSLAM_CORE_FLAGS "${BSLAM_CORE_LINE}")
foreach(language C CXX ASM)  # one ABI, whatever a program is written in
    set(CMAKE_${language}_FLAGS_INIT "-mthumb ${BSLAM_CORE_FLAGS}")
endforeach()
