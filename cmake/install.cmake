# find_package(sila) in other projects: headers, libraries and targets sila::core, sila::io, sila::service, sila::sim
# and sila::sila (all of them), as component "development".
include(CMakePackageConfigHelpers)
set(sila_config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/sila)

# One export set each, so that a project that asks for `core` needs nothing that the others need.
foreach(component IN ITEMS core sim io service sila)
  set(target sila_${component})
  if(component STREQUAL sila)
    set(target sila)
  endif()
  install(TARGETS ${target} EXPORT sila_${component} COMPONENT development
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
    RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT development)
  install(EXPORT sila_${component} NAMESPACE sila:: FILE ${component}Targets.cmake
    DESTINATION ${sila_config_dir} COMPONENT development)
endforeach()
install(DIRECTORY include/sila DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/include/sila/version.hpp
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sila COMPONENT development)

get_target_property(sila_type sila_core TYPE)
configure_package_config_file(cmake/silaConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/silaConfig.cmake
  INSTALL_DESTINATION ${sila_config_dir})
# Before 1.0 a minor version may change the API.
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/silaConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/silaConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/silaConfigVersion.cmake
  DESTINATION ${sila_config_dir} COMPONENT development)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})  # a Debian package has its own form of it
