# cmake --install: the runtime as a package for find_package(dimmer), component `runtime`; the cooker, `tools`.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/dimmer)
set_target_properties(dimmer_runtime PROPERTIES EXPORT_NAME runtime)
install(TARGETS dimmer_runtime EXPORT dimmer_targets ARCHIVE COMPONENT runtime
    INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(DIRECTORY runtime/include/ shaders/include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT runtime)
install(EXPORT dimmer_targets NAMESPACE dimmer:: DESTINATION ${package_dir} COMPONENT runtime)

configure_package_config_file(cmake/dimmerConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/dimmerConfig.cmake
    INSTALL_DESTINATION ${package_dir} NO_SET_AND_CHECK_MACRO)
# Before 1.0 every minor version may change the interface.
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/dimmerConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/dimmerConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/dimmerConfigVersion.cmake
    DESTINATION ${package_dir} COMPONENT runtime)
