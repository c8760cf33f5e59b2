# find_package(spillikin) for whoever builds on the installed library.
include(CMakePackageConfigHelpers)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/spillikin)
install(TARGETS spillikin EXPORT spillikinTargets)
install(EXPORT spillikinTargets NAMESPACE spillikin:: DESTINATION ${package})
install(TARGETS spillikin_command)
install(DIRECTORY spillikin DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h" PATTERN "cli" EXCLUDE)
install(FILES LICENSE NOTICE DESTINATION ${CMAKE_INSTALL_DOCDIR})
configure_package_config_file(cmake/spillikinConfig.cmake.in ${CMAKE_BINARY_DIR}/spillikinConfig.cmake
                              INSTALL_DESTINATION ${package})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/spillikinConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/spillikinConfig.cmake ${CMAKE_BINARY_DIR}/spillikinConfigVersion.cmake DESTINATION ${package})
set_target_properties(spillikin_command PROPERTIES INSTALL_RPATH "$ORIGIN/../${CMAKE_INSTALL_LIBDIR}")
