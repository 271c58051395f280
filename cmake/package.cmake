# What `cpack` packs, as .deb: the program, and the library with its headers. tools/deb writes the files below package/
# (man pages, the unit, copyright, changelog) before it.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_CONTACT "the sila authors <sila@example.org>")
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_COMPONENTS_ALL program development)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME sila)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "sila learns from the output of a pedestrian tracker how people walk at one
place, continues to learn from each new batch of tracks without the earlier
data, and predicts the next seconds of each pedestrian as weighted paths with
calibrated regions.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libsila-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libstdc++-12-dev, libeigen3-dev, libtbb-dev, libhwy-dev, \
nlohmann-json3-dev, libsqlite3-dev, zlib1g-dev, libexpat1-dev, libmosquitto-dev")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Headers, static libraries and the CMake package of sila, with the components
core, io, service and sim. Depends on what all of them need; sila::core alone
needs Eigen, oneTBB and Highway.")

foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  install(DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/package/${component}/ DESTINATION . COMPONENT ${component} OPTIONAL)
endforeach()
include(CPack)
