# What `cmake --install` lays down: libraries, public headers, files for find_package and pkg-config. All of it
# may be moved.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

install(TARGETS ${targets} EXPORT bslamTargets ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}")

# The headers that users include, and what those include.
foreach(header base/config.h base/real.h base/status.h base/types.h bslam/association/tuning.h bslam/bslam.h
        bslam/config.h bslam/settings.h bslam/size.h link/crc16.h link/frame.h link/parser.h vision/config.h
        vision/model.h vision/size.h vision/vision.h)
    get_filename_component(folder ${header} DIRECTORY)
    install(FILES ${header} DESTINATION include/bslam/${folder})
endforeach()

set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/bslam")
install(EXPORT bslamTargets NAMESPACE bslam:: DESTINATION "${package_dir}")
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/bslamConfigVersion.cmake"
    COMPATIBILITY SameMinorVersion)
install(FILES cmake/bslamConfig.cmake "${CMAKE_CURRENT_BINARY_DIR}/bslamConfigVersion.cmake"
    DESTINATION "${package_dir}")

file(RELATIVE_PATH prefix "/prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig" /prefix)
string(REGEX REPLACE "/$" "" prefix "${prefix}")
foreach(target ${targets})
    string(REPLACE _ - package ${target})
    set(sizes "$<TARGET_PROPERTY:${target},INTERFACE_COMPILE_DEFINITIONS>")
    set(sizes_flags "$<$<BOOL:${sizes}>: -D$<JOIN:${sizes}, -D>>")
    file(GENERATE OUTPUT "${CMAKE_CURRENT_BINARY_DIR}/${package}.pc" CONTENT
"prefix=\${pcfiledir}/${prefix}

Name: ${package}
Description: SLAM that fits in a microcontroller
Version: ${PROJECT_VERSION}
Cflags: -I\${prefix}/include/bslam${sizes_flags}
Libs: -L\${prefix}/${CMAKE_INSTALL_LIBDIR} -l${target} -lm
")
    install(FILES "${CMAKE_CURRENT_BINARY_DIR}/${package}.pc"
        DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
endforeach()
