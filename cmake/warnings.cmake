# -Wno-restrict: g++ 12 warns of overlapping copies in `"text" + std::to_string(n)`, which there are none of (GCC bug 105651).
function(sila_set_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion
    -Wnon-virtual-dtor -Wold-style-cast -Woverloaded-virtual -Wnull-dereference
    $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict>
    $<$<BOOL:${SILA_WARNINGS_AS_ERRORS}>:-Werror>)
endfunction()
