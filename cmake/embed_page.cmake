# Makes C++ of the viewer's page (viewer/dist/report.html, built and committed: see docs/viewer.md), in pieces that any
# compiler takes. Node is not needed.
set(sila_page ${CMAKE_CURRENT_SOURCE_DIR}/viewer/dist/report.html)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${sila_page})
file(READ ${sila_page} sila_page_hex HEX)
string(LENGTH "${sila_page_hex}" sila_page_digits)
set(sila_page_code "// Made by cmake/embed_page.cmake.\n#pragma once\n\nnamespace sila::detail {\ninline const char* const kEmbeddedPage[] = {\n")
foreach(start RANGE 0 ${sila_page_digits} 16000)
  string(SUBSTRING "${sila_page_hex}" ${start} 16000 sila_page_piece)
  string(REGEX REPLACE "(..)" "\\\\x\\1" sila_page_piece "${sila_page_piece}")
  string(APPEND sila_page_code "\"${sila_page_piece}\",\n")
endforeach()
string(APPEND sila_page_code "};\n}  // namespace sila::detail\n")
file(CONFIGURE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/private/embedded_page.hpp CONTENT "${sila_page_code}" @ONLY)
