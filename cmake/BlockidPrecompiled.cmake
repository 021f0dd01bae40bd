# What library and program parse over and over, parsed once for each target.

include_guard(GLOBAL)

# blockid_precompile_headers(<target>): Eigen and the standard headers that most sources use. Sources still include what
# they need: the clang-tidy build has no precompiled headers.
function(blockid_precompile_headers target)
  target_precompile_headers(
    ${target}
    PRIVATE
    <Eigen/Dense>
    <algorithm>
    <cmath>
    <complex>
    <functional>
    <limits>
    <memory>
    <optional>
    <span>
    <sstream>
    <string>
    <utility>
    <vector>)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
    # Lets ccache see through the precompiled header.
    target_compile_options(${target} PRIVATE -fpch-preprocess)
  endif()
endfunction()
