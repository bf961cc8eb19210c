# The program, the libraries with their headers, and what find_package(gdfmap) reads.
include(CMakePackageConfigHelpers)

set(package_directory ${CMAKE_INSTALL_LIBDIR}/cmake/gdfmap)
install(TARGETS gdfmap_program RUNTIME)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/gdfmap TYPE INCLUDE)
install(EXPORT gdfmap-targets NAMESPACE gdfmap:: DESTINATION ${package_directory})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/gdfmap-config-version.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_SOURCE_DIR}/cmake/gdfmap-config.cmake
              ${PROJECT_SOURCE_DIR}/cmake/gdfmap-dependencies.cmake
              ${PROJECT_BINARY_DIR}/gdfmap-config-version.cmake
        DESTINATION ${package_directory})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/README.md TYPE DOC)
install(FILES ${PROJECT_SOURCE_DIR}/config/default.yaml ${PROJECT_SOURCE_DIR}/schema/config.schema.json
        DESTINATION ${CMAKE_INSTALL_DATADIR}/gdfmap)
