# Writes OUT, the source that states the git revision of SOURCE, if it would change: 8 digits, "+" after them if files
# differ from it; in an archive by `git archive` the revision of that; "unknown" without any.
# Needs: SOURCE, OUT; VERSION of sila
set(revision "$Format:%H$")
if(revision MATCHES "^[0-9a-f]+$")
  string(SUBSTRING ${revision} 0 8 revision)
else()
  set(revision "")
  if(EXISTS ${SOURCE}/.git)  # not the repository of a project that has the sources in a folder
    execute_process(OUTPUT_VARIABLE revision OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET
      COMMAND git -c safe.directory=${SOURCE} -C ${SOURCE} --no-optional-locks describe --always --exclude=* --abbrev=8 --dirty=+)
  endif()
endif()
set(text "${revision}")
if(NOT revision)
  set(revision "unknown")
  set(text "unknown revision")
endif()
file(CONFIGURE OUTPUT ${OUT} @ONLY CONTENT [[// Made by cmake/revision.cmake.
#include "sila/version.hpp"

namespace sila {
std::string_view build_revision() { return "@revision@"; }
std::string_view build_version() { return "@VERSION@ (@text@)"; }
}  // namespace sila
]])
