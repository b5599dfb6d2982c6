# What the builds by CMake, ESP-IDF and Zephyr share: sources, sizes, flags.
get_filename_component(BSLAM_FIRMWARE "${CMAKE_CURRENT_LIST_DIR}" DIRECTORY)

# bslam_sources(OUT LIBRARY...): every source of these libraries, and of base.
function(bslam_sources out)
    set(patterns "")
    foreach(folder base ${ARGN})
        list(APPEND patterns "${BSLAM_FIRMWARE}/${folder}/*.c")
    endforeach()
    if(CMAKE_SCRIPT_MODE_FILE)  # ESP-IDF's first pass, which builds nothing
        file(GLOB_RECURSE sources ${patterns})
    else()
        file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${patterns})
    endif()
    if(DEFINED CONFIG_BSLAM_VISION_BUILT_IN AND NOT CONFIG_BSLAM_VISION_BUILT_IN)
        list(FILTER sources EXCLUDE REGEX "/vision/built_in/")
    endif()
    set(${out} ${sources} PARENT_SCOPE)
endfunction()

# bslam_sizes(OUT): the macros that an application may set.
function(bslam_sizes out)
    set(names "")
    foreach(folder base bslam vision)
        file(STRINGS "${BSLAM_FIRMWARE}/${folder}/config.h" lines REGEX "^#ifndef ")
        list(APPEND names ${lines})
    endforeach()
    list(FILTER names EXCLUDE REGEX "_H$")
    list(TRANSFORM names REPLACE "#ifndef " "")
    set(${out} ${names} PARENT_SCOPE)
endfunction()

# bslam_kconfig_sizes(OUT): NAME=VALUE of each that Kconfig sets.
function(bslam_kconfig_sizes out)
    bslam_sizes(names)
    set(sizes "")
    foreach(name ${names})
        if(DEFINED CONFIG_${name})
            list(APPEND sizes ${name}=${CONFIG_${name}})
        endif()
    endforeach()
    set(${out} ${sizes} PARENT_SCOPE)
endfunction()

# Contraction (fused multiply-add) would change the last bit from one machine to the next.
set(BSLAM_FLAGS -ffp-contract=off -fno-math-errno -ffunction-sections -fdata-sections)
