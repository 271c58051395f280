# -Wno-restrict: g++ 12 warns of overlapping copies in `"text" + std::to_string(n)`, which there are none of (GCC bug 105651).
# -Wnull-dereference: g++ follows, in every Eigen vector whose size it does not know, the path on which the size is 0 and the
# storage null, and warns of each access; clang means by it what it says.
# -Wcomma: `a = 1, b = 2;` is two statements; only clang has this warning.
function(sila_set_warnings target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion
    -Wnon-virtual-dtor -Wold-style-cast -Woverloaded-virtual
    "$<$<CXX_COMPILER_ID:Clang,AppleClang>:-Wnull-dereference;-Wcomma>"
    $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict>
    $<$<BOOL:${SILA_WARNINGS_AS_ERRORS}>:-Werror>)
endfunction()
