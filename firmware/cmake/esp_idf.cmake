# The component for ESP-IDF. Its sizes are the application's, too.
include("${CMAKE_CURRENT_LIST_DIR}/files.cmake")
bslam_sources(sources bslam vision link)
idf_component_register(SRCS ${sources} INCLUDE_DIRS "${BSLAM_FIRMWARE}")
target_compile_options(${COMPONENT_LIB} PRIVATE ${BSLAM_FLAGS})
bslam_kconfig_sizes(sizes)
target_compile_definitions(${COMPONENT_LIB} PUBLIC ${sizes})
