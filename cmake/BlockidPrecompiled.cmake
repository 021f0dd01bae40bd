# What library and program parse over and over, parsed once.

include_guard(GLOBAL)

# blockid_precompile_headers(<target>): Eigen, its dense decompositions as compiled once by data/, JSON, and the standard
# headers that most sources use. The first caller (data/) builds the precompiled header, all others share it. Sources
# still include what they need: the clang-tidy build has no precompiled headers.
function(blockid_precompile_headers target)
  if(TARGET blockid_data AND NOT target STREQUAL "blockid_data")
    target_precompile_headers(${target} REUSE_FROM blockid_data)
  else()
    target_precompile_headers(
      ${target}
      PRIVATE
      <Eigen/Dense>
      <blockid/data/dense_decompositions.hpp>
      <nlohmann/json.hpp>
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
    # Header-only; nothing of it is compiled into data/.
    target_include_directories(${target} SYSTEM PRIVATE
                               $<TARGET_PROPERTY:nlohmann_json::nlohmann_json,INTERFACE_INCLUDE_DIRECTORIES>)
  endif()
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
    # Lets ccache see through the precompiled header.
    target_compile_options(${target} PRIVATE -fpch-preprocess)
  endif()
endfunction()

# blockid_batch_sources(<target>): with BLOCKID_UNITY_BUILD, several sources at once in one translation unit, so that
# they share what they instantiate from templates. Names that are local to a file must then differ from those of its
# neighbours; the release preset, hence scripts/test, builds this way and the dev preset file by file.
function(blockid_batch_sources target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD "${BLOCKID_UNITY_BUILD}" UNITY_BUILD_BATCH_SIZE 8)
endfunction()
